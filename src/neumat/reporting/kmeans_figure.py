"""The picture of k-means on mean and maximum reflectance (M3ashy, Fig. 25)."""

import numpy as np

from neumat.reporting.style import ACCENT, COLOURS, MARKERS, MUTED, figure, save_figure
from neumat.studies.categories import PAPER_BOUNDARIES
from neumat.studies.clusters import CLUSTERS, cluster


def kmeans_figure(statistics, path, seed=0):
    """Draw k-means on mean (left) and maximum (right) reflectance of the red channel, in order; M3ashy, Fig. 25.

    Colours are the clusters on the logarithmic scale; lines are the boundaries on both scales and the paper's.
    """
    with figure(7.5, 3.4, ncols=2) as (drawn, axes):
        for axis, quantity in zip(axes, ("mean", "maximum"), strict=True):
            values = np.sort(statistics[f"{quantity}_r"].to_numpy(float))
            labels, logarithmic = cluster(values, True, seed)
            linear = cluster(values, False, seed)[1]
            for k in range(CLUSTERS):
                rank = np.flatnonzero(labels == k)
                axis.scatter(rank + 1, values[rank], s=14, color=COLOURS[k], marker=MARKERS[k], linewidths=0, zorder=3)
            lines = [(logarithmic, "k-means, logarithmic", "-", "black"), (linear, "k-means, linear", "--", MUTED)]
            if quantity == "maximum":
                lines.append((PAPER_BOUNDARIES, "M3ashy: 100 and 600", ":", ACCENT))
            for boundaries, label, style, colour in lines:
                for k, boundary in enumerate(boundaries):
                    shown = label if k == 0 else None
                    axis.axhline(boundary, color=colour, linestyle=style, linewidth=1, label=shown, zorder=2)
            axis.set(yscale="log", xlabel="materials in ascending order", ylabel="reflectance, 1/sr")
            axis.set_title(f"{quantity} of the red channel")
        handles, names = axes[1].get_legend_handles_labels()
        drawn.legend(handles, names, loc="outside lower center", ncols=len(names), fontsize=7)
        save_figure(drawn, path)
