"""Noise against time, a panel for each kind of material, a line for each way of drawing directions."""

from matplotlib.ticker import LogLocator, NullFormatter

from neumat.reporting.style import ACCENT, COLOURS, MARKERS, figure, save_chart

# Of `neumat.studies.bsdf_sampling.noise_sweep`, in the legend's order.
LABELS = {
    "uniform": "uniform",
    "cosine": "cosine",
    "ggx": "cosine + one GGX lobe",
    "fitted": "fitted lobes (default)",
    "measured": "Mitsuba's measured, exported file",
}


def noise_chart(table, path_stem):
    """Draw `noise_sweep`'s table into `path_stem`.png and .svg: PSNR against seconds, which is logarithmic."""
    kinds = list(dict.fromkeys(table["kind"]))
    with figure(2.3 * len(kinds), 3.0, ncols=len(kinds), squeeze=False) as (drawn, grid):
        for axes, kind in zip(grid[0], kinds, strict=True):
            part = table[table["kind"] == kind]
            for i, (sampler, label) in enumerate(LABELS.items()):
                line = part[part["sampler"] == sampler]
                default = sampler == "fitted"
                axes.plot(
                    line["seconds"],
                    line["psnr"],
                    color=ACCENT if default else COLOURS[(0, 2, 3, 1, 6)[i]],
                    marker=MARKERS[i],
                    markersize=3.5,
                    linewidth=1.8 if default else 1,
                    label=label,
                )
            axes.set(xscale="log", xlabel="seconds", title=f"{kind}: {part['material'].iloc[0]}")
            axes.title.set_fontsize(7)
            axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
        grid[0, 0].set_ylabel("PSNR, dB")
        drawn.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(LABELS))
        save_chart(drawn, path_stem)
