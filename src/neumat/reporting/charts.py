"""Speed-accuracy charts: every setting tried, the frontier through the best, the default marked."""

import itertools

import numpy as np
from matplotlib.text import Text
from matplotlib.ticker import LogLocator, NullFormatter

from neumat.errors import NeumatError
from neumat.reporting.style import ACCENT, COLOURS, MARKERS, MUTED, figure, save_chart

# Where a name may stand about its point, in points, nearest first; from _FAR on, a thin line leads to it.
_FAR = 10
_PLACES = [
    (radius * dx, radius * dy)
    for radius in (5, _FAR, 18)
    for dx, dy in ((1, 1), (-1, -1), (1, -1), (-1, 1), (0, 1.4), (0, -1.4), (1.4, 0), (-1.4, 0))
]


def pareto(cost, loss):
    """Return the indices of the settings that no cheaper or equally cheap one beats, in order of cost.

    cost, loss: arrays (n,), lower is better in both; settings that are not finite are never on the frontier.
    """
    cost, loss = np.asarray(cost, float), np.asarray(loss, float)
    finite = np.flatnonzero(np.isfinite(cost) & np.isfinite(loss))
    order = finite[np.lexsort((loss[finite], cost[finite]))]
    best = np.minimum.accumulate(np.concatenate([[np.inf], loss[order]]))
    return order[loss[order] < best[:-1]]


def frontier_chart(
    table, x, y, label, default_label, path_stem, goal="min", group=None, x_title=None, y_title=None, title="", apart=()
):
    """Draw column `y` against column `x` (logarithmic) of a DataFrame into `path_stem`.png and .svg.

    label: the column that names a setting; the one equal to `default_label` (None: none) is marked, and it and the
    settings on the frontier carry their names. goal: "min", "max" or a number, the value that `y` should reach, drawn
    as a line. group: a column that picks colour and marker; apart: groups that are on no frontier. Raises NeumatError
    where the table lacks `default_label`.
    """
    if default_label is not None and default_label not in set(table[label]):
        raise NeumatError(f"{path_stem}: default", f"one of the settings in {label!r}", repr(default_label))
    cost, value = table[x].to_numpy(float), table[y].to_numpy(float)
    loss = {"min": value, "max": -value}[goal] if isinstance(goal, str) else np.abs(value - goal)
    groups = table[group].astype(str).to_numpy() if group else np.array([""] * len(table))
    frontier = pareto(cost, np.where(np.isin(groups, apart), np.inf, loss))
    with figure(5.6, 3.6) as (drawn, axes):
        axes.set(xscale="log", xlabel=x_title or x, ylabel=y_title or y)
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_title(title)
        if not isinstance(goal, str):
            axes.axhline(goal, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        axes.plot(cost[frontier], value[frontier], color=MUTED, linewidth=1, zorder=2)
        for i, name in enumerate(dict.fromkeys(groups)):
            part = groups == name
            style = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}
            axes.scatter(cost[part], value[part], s=22, linewidths=0, label=name, zorder=3, **style)
        named = list(frontier)
        if default_label is not None:
            default = int(np.flatnonzero(table[label] == default_label)[0])
            ring = {"facecolors": "none", "edgecolors": ACCENT, "linewidths": 1.5}
            axes.scatter(cost[default], value[default], s=110, zorder=4, **ring)
            named = [default, *(i for i in frontier if i != default)]
        if group:
            axes.legend(title=group, title_fontsize=8, alignment="left", loc="center left", bbox_to_anchor=(1, 0.5))
        axes.margins(x=0.12, y=0.14)
        texts = table[label].astype(str).to_numpy()
        _name_points(drawn, axes, cost, value, [(i, texts[i]) for i in named], frontier, default_label)
        save_chart(drawn, path_stem)


def _name_points(drawn, axes, x, y, names, frontier, default_label):
    """Write the names beside their points, nearest where they hide no point, no line and no earlier name.

    A name without such a place is left out, but never the default's, which is the first.
    """
    drawn.canvas.draw()
    finite = np.isfinite(x) & np.isfinite(y)
    corners = axes.transData.transform(np.column_stack([x, y])[frontier])
    steps = np.linspace(0, 1, 40)[:, None]
    line = [start + steps * (end - start) for start, end in itertools.pairwise(corners)]
    obstacles = np.concatenate([axes.transData.transform(np.column_stack([x, y])[finite]), *line])
    inside, taken = axes.get_window_extent(), []
    for i, name in names:
        is_default = name == str(default_label)
        for dx, dy in _PLACES:
            text = _annotate(axes, f"{name} (default)" if is_default else name, (x[i], y[i]), (dx, dy), is_default)
            box = _text_box(text, drawn)
            fits = inside.contains(box.x0, box.y0) and inside.contains(box.x1, box.y1)
            if fits and not box.count_contains(obstacles) and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()
    if default_label is not None and not taken:
        i, name = names[0]
        _annotate(axes, f"{name} (default)", (x[i], y[i]), _PLACES[0], True)


def _annotate(axes, name, point, place, is_default):
    dx, dy = place
    far = max(abs(dx), abs(dy)) > 1.4 * _FAR
    return axes.annotate(
        name,
        point,
        xytext=(1.6 * dx, 1.6 * dy) if is_default else place,
        textcoords="offset points",
        ha={1: "left", 0: "center", -1: "right"}[np.sign(dx)],
        va={1: "bottom", 0: "center", -1: "top"}[np.sign(dy)],
        fontsize=7,
        fontweight="bold" if is_default else "normal",
        color=ACCENT if is_default else "black",
        zorder=5,
        arrowprops={"arrowstyle": "-", "color": MUTED, "linewidth": 0.4, "shrinkA": 1, "shrinkB": 3} if far else None,
    )


def _text_box(annotation, drawn):
    """Return the box of an annotation's text alone, without its line, a little padded."""
    annotation.update_positions(drawn.canvas.get_renderer())
    return Text.get_window_extent(annotation).padded(2)
