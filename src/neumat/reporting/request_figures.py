"""What was asked for beside what came: M3ashy's Figs. 7 to 9, and chart 3."""

import numpy as np

from neumat.reporting.style import COLOURS, MARKERS, MUTED, figure, save_chart, save_figure


def request_sheet(labels, pictures, path, shown=None, groups=2):
    """Write rows of pictures, each under what was asked for, as PNG.

    labels (r,): texts; pictures uint8 (r, n, H, W, 3); shown: None, or what was asked with, uint8 (r, h, w, 3), set
    before the label's row. groups: how many requests stand side by side.
    """
    rows = -(-len(labels) // groups)
    per_row = pictures.shape[1] + (shown is not None)
    ratios = {"height_ratios": [1] * rows, "wspace": 0.06}
    with figure(1.0 * per_row * groups, 1.22 * rows, nrows=rows, ncols=groups, squeeze=False, gridspec_kw=ratios) as (
        drawn, axes,
    ):  # fmt: skip
        for axis in axes.flat:
            axis.axis("off")
        for i, label in enumerate(labels):
            axis, strip = axes.flat[i], list(pictures[i])
            if shown is not None:
                strip = [_framed(shown[i], strip[0].shape[0]), *strip]
            axis.imshow(np.concatenate(strip, axis=1))
            axis.set_title(label, fontsize=8, fontweight="normal", pad=2)
        save_figure(drawn, path, dpi=pictures.shape[3])  # a picture an inch: enlarged, they would fill the report


def empty_page(line, path):
    """Write a PNG that says in one line why nothing is shown."""
    with figure(5, 0.5) as (drawn, axes):
        axes.axis("off")
        axes.set_title(line, fontsize=8, fontweight="normal")
        save_figure(drawn, path)


def _framed(picture, size):
    """Return a picture enlarged or reduced to `size` by its nearest pixels, with a white edge on the right."""
    index = np.arange(size) * len(picture) // size
    framed = np.asarray(picture)[index][:, index].copy()
    framed[:, -size // 24 :] = 255
    return framed


def guidance_chart(table, usual, path):
    """Write chart 3, PNG and SVG: how well requests are met, how diverse the answers are and how many of the raw draws
    are no valid BRDF, against the guidance scale.

    table: of `studies.request_sweeps.guidance_sweep`. usual: the scales in use, marked. path: of the PNG.
    """
    x = np.arange(len(table))  # evenly spaced, whatever the scales
    panels = (
        (("type_right", "Type"), ("colour_right", "Colour words"), ("gloss_right", "Gloss words")),
        (
            ("image_rmse", "RMSE to the image"),
            ("diversity", "Diversity"),
            ("nearest", "To nearest training"),
        ),
        (("invalid", "No valid BRDF"),),
    )
    titles = ("Share right", "Distances", "Share of raw draws")
    with figure(8.4, 2.8, ncols=3) as (drawn, axes):
        for axis, curves, title in zip(axes, panels, titles, strict=True):
            for k, (column, name) in enumerate(curves):
                if table[column].isna().all():
                    name += " (not measured)"
                axis.plot(x, table[column], color=COLOURS[k], marker=MARKERS[k], markersize=4, linewidth=1, label=name)
            for i in np.flatnonzero(table["guidance"].isin(usual)):
                axis.axvline(i, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
            axis.set_xticks(x, [f"{g:g}" for g in table["guidance"]])
            axis.set(xlabel="guidance scale w", title=title, ylim=(0, None))
            axis.legend(fontsize=7)
        save_chart(drawn, path.with_suffix(""))
