"""Chart 5: what a scene's models cost against the error that it may show."""

import pandas as pd

from neumat.reporting.style import ACCENT, COLOURS, MARKERS, MUTED, figure, save_chart


def costs(table):
    """Return a DataFrame with a row for each scene and tolerance of the scenes' model tables.

    kept: how many materials need all their weights; bytes: of all; ns: of a query, by how often each material is asked;
    *_share: of those of 675 weights everywhere, `seconds` for the picture; predicted, measured, noise, fit_error: mean
    FLIP of the worst object; below_fit_error, exceeds: on how many objects the tolerance is less than what their fields
    show, and is exceeded.
    """
    rows = []
    for (scene, tolerance), group in table.groupby(["scene", "tolerance"], sort=False):
        ns, ns_field = ((group[key] * group["queries"]).sum() / group["queries"].sum() for key in ("ns", "ns_field"))
        objects = group.groupby("object")
        rows.append(
            {
                "scene": scene,
                "tolerance": tolerance,
                "materials": len(group),
                "kept": int((group["bytes"] == group["bytes_field"]).sum()),
                "bytes": group["bytes"].sum(),
                "bytes_share": group["bytes"].sum() / group["bytes_field"].sum(),
                "ns": ns,
                "ns_share": ns / ns_field,
                "seconds_share": group["seconds"].iloc[0] / group["seconds_field"].iloc[0],
                **{key: group[key].max() for key in ("predicted", "measured", "noise", "fit_error", "upgrades")},
                **{key: int(objects[key].first().sum()) for key in ("below_fit_error", "exceeds")},
            }
        )
    return pd.DataFrame(rows)


def models_chart(table, tolerance, path_stem):
    """Draw `costs` into `path_stem`.png and .svg: bytes, time of a query and the error measured, against tolerance.

    Marks are hollow where the tolerance is below the error of an object's fields.
    """
    panels = (
        ("bytes_share", "bytes, share of all weights"),
        ("ns_share", "time of a query, the same share"),
        ("measured", "mean FLIP, worst object"),
    )
    with figure(9.0, 3.2, ncols=3, squeeze=False) as (drawn, grid):
        for axes, (column, title) in zip(grid[0], panels, strict=True):
            for i, (scene, part) in enumerate(table.groupby("scene", sort=False)):
                style = {"color": COLOURS[i], "marker": MARKERS[i], "markersize": 4}
                axes.plot(part["tolerance"], part[column], label=scene, **style)
                below = part[part["below_fit_error"] > 0]
                axes.plot(below["tolerance"], below[column], linestyle="", markerfacecolor="white", **style)
            axes.axvline(tolerance, color=ACCENT, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
            axes.set(xscale="log", xlabel="tolerance: mean FLIP of every object", title=title)
            axes.set_xticks(sorted(table["tolerance"].unique()))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.minorticks_off()
            axes.set_ylim(bottom=0)
        limits = sorted(table["tolerance"].unique())
        grid[0, 2].plot(limits, limits, color=MUTED, linewidth=0.8, zorder=1)
        drawn.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        save_chart(drawn, path_stem)
