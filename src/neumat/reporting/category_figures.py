"""Pictures of the statistics behind the categories (M3ashy, Figs. 23 and 24), and of what constrained samples cost."""

import numpy as np

from neumat.brdf.categories import CATEGORIES
from neumat.reporting.style import COLOURS, MARKERS, MUTED, figure, save_figure
from neumat.studies.categories import PAPER_BOUNDARIES

_RGB = {"r": ("#D55E00", "o"), "g": ("#009E73", "s"), "b": ("#0072B2", "D")}  # colour and shape tell channels apart
_ROW = 0.135  # inches


def statistics_by_type(table, path):
    """Draw mean and maximum reflectance per channel of every type, means over its materials; M3ashy, Fig. 23.

    table: of studies.categories.source_table.
    """
    values = table.groupby("type").mean(numeric_only=True)
    values = values.iloc[np.argsort(values[["maximum_r", "maximum_g", "maximum_b"]].max(axis=1), kind="stable")]
    with figure(7, 0.9 + _ROW * len(values), ncols=2, sharey=True) as (drawn, axes):
        for axis, quantity in zip(axes, ("mean", "maximum"), strict=True):
            _rows(axis, values, quantity)
            axis.set(xscale="log", xlabel=f"{quantity} reflectance, 1/sr")
        counts = table["type"].value_counts()
        names = [f"{name} ({counts[name]})" if counts[name] > 1 else name for name in values.index]
        axes[0].set_yticks(range(len(values)), names)
        axes[0].set_ylim(-0.8, len(values) - 0.2)
        _thresholds(axes[1])
        _channel_legend(drawn)
        save_figure(drawn, path)


def statistics_by_material(table, path):
    """Draw mean (open) and maximum (filled) reflectance per channel of every material, by family and type; M3ashy,
    Fig. 24.

    table: of studies.categories.source_table.
    """
    families = list(table["family"].value_counts().index)
    columns = [[], []]
    for family in families:  # the largest first, into the emptier column
        part = table[table["family"] == family].sort_values(["type", "maximum"])
        shorter = min(columns, key=lambda blocks: sum(len(block) + 1 for block in blocks))
        shorter.append(part)
    rows = max(sum(len(block) + 1 for block in blocks) for blocks in columns)
    with figure(9, 0.9 + _ROW * rows, ncols=2, sharex=True) as (drawn, axes):
        axes[1].set_visible(len(families) > 1)
        for axis, blocks in zip(axes, filter(None, columns), strict=False):
            _families(axis, blocks)
            axis.set(xscale="log", xlabel="mean (open) and maximum (filled) reflectance, 1/sr", ylim=(rows - 0.4, -0.6))
        _channel_legend(drawn)
        save_figure(drawn, path)


def constrained_chart(table, path):
    """Draw what one accepted material costs in seconds, by category and way of sampling, into a PNG.

    table: of studies.constrained.constrained_table. Categories from common to rare in the training materials. A
    search that found nothing shows as an open arrow at all of its seconds: the cost lies beyond. Dashed: ten times the
    cost of the commonest.
    """
    share = table.groupby("category")["training_share"].first()
    order = sorted(share.index, key=lambda name: (share[name], CATEGORIES.index(name)))
    with figure(5.6, 1.1 + 0.32 * len(order)) as (drawn, axes):
        for k, (way, rows) in enumerate(table.groupby("way", sort=False)):
            y = rows["category"].map(order.index).to_numpy()
            found = rows["accepted"].to_numpy() > 0
            style = {"color": COLOURS[k % len(COLOURS)], "zorder": 3}
            axes.scatter(
                rows["seconds_per_accepted"][found], y[found], s=32, marker=MARKERS[k], label=way, linewidths=0, **style
            )
            axes.scatter(rows["seconds"][~found], y[~found], s=40, marker=">", facecolors="none", edgecolors=COLOURS[k])
            commonest = rows["seconds_per_accepted"].iloc[y.argmax()]
            if np.isfinite(commonest):
                axes.axvline(10 * commonest, color=COLOURS[k], linestyle="--", linewidth=1, zorder=1)
        axes.set(xscale="log", xlabel="seconds per accepted material", ylim=(-0.6, len(order) - 0.4))
        axes.set_yticks(range(len(order)), [f"{name} ({100 * share[name]:.1f} %)" for name in order])
        axes.legend(title="way", title_fontsize=8, alignment="left", loc="center left", bbox_to_anchor=(1, 0.5))
        axes.set_title("Cost, and share of the training materials")
        save_figure(drawn, path)


def constrained_sheet(image, message, path):
    """Write a contact sheet, uint8 (H, W, 3), under the line that says how its search ended; None: the line alone."""
    width = 7.5
    rows, columns = (1, 20) if image is None else image.shape[:2]
    with figure(width, 0.3 + width * rows / columns) as (drawn, axes):
        axes.axis("off")
        axes.set_title(message, fontweight="normal", fontsize=7)
        if image is not None:
            axes.imshow(image)
        save_figure(drawn, path, dpi=columns / width)  # no larger than it is: the report has one of each category


def _rows(axis, values, quantity, at=0, filled=True):
    """Draw the three channels of the rows of `values` from y = `at` on, with a line from the least to the greatest."""
    y = at + np.arange(len(values))
    channels = values[[f"{quantity}_{channel}" for channel in _RGB]].to_numpy(float)
    axis.hlines(y, channels.min(1), channels.max(1), color=MUTED, linewidth=0.6, zorder=2)
    for column, (colour, marker) in zip(channels.T, _RGB.values(), strict=True):
        face = colour if filled else "white"
        axis.scatter(column, y, s=11, marker=marker, facecolors=face, edgecolors=colour, linewidths=0.7, zorder=3)


def _families(axis, blocks):
    """Draw blocks of materials below one another, each under the name of its family."""
    ticks, at = [], 0
    for block in blocks:
        ticks.append((at, block["family"].iloc[0].upper()))
        at += 1
        _rows(axis, block, "mean", at, filled=False)
        _rows(axis, block, "maximum", at)
        ticks += [(at + k, name) for k, name in enumerate(block["name"])]
        at += len(block)
    axis.set_yticks(*zip(*ticks, strict=True), fontsize=6.5)
    for label in axis.get_yticklabels():
        label.set_fontweight("bold" if label.get_text().isupper() else "normal")
    _thresholds(axis)


def _thresholds(axis):
    for boundary in PAPER_BOUNDARIES:
        axis.axvline(boundary, color=MUTED, linewidth=0.8, linestyle=":", zorder=1)


def _channel_legend(drawn):
    handles = [
        drawn.axes[0].scatter([], [], color=colour, marker=marker, s=14, label=name)
        for name, (colour, marker) in zip(("red", "green", "blue"), _RGB.values(), strict=True)
    ]
    drawn.legend(handles=handles, loc="outside upper right", ncols=3, title_fontsize=8)
