"""Coverage of unseen sources over folds: the table, with intervals, and the chart of coverage against precision."""

import numpy as np
import pandas as pd

from neumat.reporting.style import ACCENT, COLOURS, MARKERS, MUTED, figure, save_chart
from neumat.seeds import numpy_generator

OWN = "held-out"  # the method of the materials themselves
MODEL = "hyperdiffusion"
COPIES = "copies"
LABELS = {
    "copies": "copies",
    "noisy-copies": "copies + noise",
    "interpolations": "weights of bases interpolated",
    "interpolated-sources": "weights of sources interpolated",
    "recoloured-interpolations": "the same, colour and brightness",
    "powers-of-interpolations": "the same, powers of 1 + f",
    "blends": "blends of f",
    "logarithmic-blends": "blends of log(1 + f)",
    "brightened": "sources, brightness",
    "recoloured": "sources, colour and brightness",
    "dense": "draws of the dense set",
}
_MEDIANS = ["precision", "novelty", "novelty, any tint", "novelty, bases", "valid"]


def coverage_table(rows, resamples, seed):
    """Return one row for each method, level and size: means over the folds of the rows of `studies.coverage`.

    Columns: folds, method, level, size, coverage with its 95 % interval (low, high), relative to that of copies
    (of_copies), the medians and shares of samples, and, at the largest size, `frontier`, the best coverage of a null
    whose precision is as good, with `behind`, the difference from it, and its interval. Intervals are percentiles over
    resamplings of the held-out sources of each fold, the same for all methods. The method "held-out" is the held-out
    sources themselves; its precision is that of all sources among each other.
    """
    folds = ", ".join(sorted(set(rows["protocol"])))
    covered = rows[rows["measure"] == "coverage"]
    wide = covered.pivot_table("value", ["protocol", "item"], ["method", "level", "size"], sort=False)
    weights = _resampled(wide.index.get_level_values("protocol"), resamples, seed)
    means = weights @ wide.to_numpy(float)  # the first row is that of every held-out source once
    medians = rows[rows["measure"] != "coverage"].groupby(["method", "level", "measure"])["value"].mean().unstack()
    columns = {key: i for i, key in enumerate(wide.columns)}
    largest = max(size for *_, size in columns)
    table = []
    for (method, level, size), i in columns.items():
        row = {"folds": folds, "method": method, "level": level, "size": size}
        row |= dict(zip(("coverage", "low", "high"), _interval(means[:, i]), strict=True))
        row["of_copies"] = means[0, i] / means[0, columns[COPIES, 0, size]]
        row |= medians.loc[method, level].reindex(_MEDIANS).to_dict()
        table.append(row)
    table = pd.DataFrame(table).assign(frontier=np.nan, null="", behind=np.nan, behind_low=np.nan, behind_high=np.nan)
    last = table[table["size"] == largest]
    for i, row in last.iterrows():
        others = last.drop(index=i)
        nulls = others[(others["method"] != MODEL) & (others["precision"] <= row["precision"])]
        if len(nulls):
            best = nulls.loc[nulls["coverage"].idxmin()]
            behind = means[:, i] - means[:, columns[best["method"], best["level"], largest]]
            table.loc[i, "frontier"], table.loc[i, "null"] = best["coverage"], f"{best['method']} {best['level']:g}"
            table.loc[i, ["behind", "behind_low", "behind_high"]] = _interval(behind)
    own = medians.loc[OWN].iloc[0].reindex(_MEDIANS).to_dict()
    return pd.concat([table, pd.DataFrame([{"folds": folds, "method": OWN, **own}])], ignore_index=True)


def verdict(table):
    """Return one sentence on whether a null of a `coverage_table` covers unseen materials better than the model."""
    model = table[(table["method"] == MODEL) & (table["size"] == table["size"].max())].iloc[0]
    figures = f"{model['coverage']:.4f}, {model['of_copies']:.2f} of copies'"
    if pd.isna(model["behind"]):
        return f"No null is as precise as the default model, which covers unseen materials to {figures}."
    null = f"the null `{model['null']}` ({model['frontier']:.4f})"
    if model["behind_low"] > 0:
        return f"A null dominates the default model: {null} is as precise and covers more ({figures})."
    if model["behind_high"] < 0:
        return f"The default model covers unseen materials ({figures}) better than any null that is as precise: {null}."
    return f"The default model covers unseen materials ({figures}) as well as the best null that is as precise: {null}."


def _resampled(protocols, resamples, seed):
    """Return (1 + resamples, n) shares of the n held-out sources: each once, then drawn anew within each fold."""
    protocols = np.asarray(protocols)
    folds = np.unique(protocols)
    shares = np.zeros((1 + resamples, len(protocols)))
    for fold in folds:
        members = np.flatnonzero(protocols == fold)
        generator = numpy_generator(seed, "bootstrap of coverage", fold)
        counts = generator.multinomial(len(members), np.full(len(members), 1 / len(members)), resamples)
        shares[:, members] = np.concatenate([np.ones((1, len(members))), counts]) / len(members) / len(folds)
    return shares


def _interval(values):
    """Return (mean, low, high) of the mean and its resamplings, in this order."""
    return values[0], *np.quantile(values[1:], [0.025, 0.975], method="nearest")


def coverage_chart(table, path_stem):
    """Draw coverage at the largest size against precision: every null a curve over its level, the model a star.

    table: of `coverage_table`. The star's bar is the interval of the difference from the best null that is as precise.
    The dashed line is how far real materials are from one another.
    """
    last = table[table["size"] == table["size"].max()]
    own = table[table["method"] == OWN].iloc[0]
    with figure(6.4, 4) as (drawn, axes):
        axes.set(
            xlabel="Precision: distance of samples to the nearest real material, median",
            ylabel=f"Coverage: distance of unseen materials\nto the nearest of {last['size'].iloc[0]:,.0f} samples",
        )
        axes.axvline(own["precision"], color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        for i, (method, part) in enumerate(last[last["method"] != MODEL].groupby("method", sort=False)):
            style = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}
            axes.plot(part["precision"], part["coverage"], label=LABELS.get(method, method), ms=4, lw=1, **style)
        model = last[last["method"] == MODEL]
        spread = [model["behind"] - model["behind_low"], model["behind_high"] - model["behind"]]
        axes.errorbar(
            model["precision"], model["coverage"], spread, color=ACCENT, marker="*", ms=11, capsize=3, zorder=4,
            linestyle="none", label="the default model",
        )  # fmt: skip
        axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))
        save_chart(drawn, path_stem)
