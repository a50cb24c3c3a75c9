"""The tables: scores averaged over draws with their intervals, beside the published figures."""

from importlib import resources

import numpy as np
import pandas as pd

from neumat.seeds import numpy_generator

# The rows' order and names; a method that is not listed comes last, under its own name.
LABELS = {
    "training-set": "training set",
    "hyperdiffusion": "hyperdiffusion (ours)",
    "pca-a": "PCA-A",
    "pca-n": "PCA-N",
    "vae-a": "VAE-A",
    "vae-n": "VAE-N",
    "merl100": "MERL100",
    "copies": "null: copies",
    "noisy-copies": "null: copies + noise",
    "interpolations": "null: interpolations",
}
INCEPTION = "Frechet-Inception64"  # what `metrics.score` calls the distance of these features
_TITLES = {
    "one_nna": "1-NNA, % (50 is best)",
    "cov": "COV, % (higher is better)",
    "mmd": "MMD (lower is better)",
}
PSNR_NOTE = "PSNR is a function of RMSE, so 1-NNA and COV are the same by both."
PUBLISHED_NOTE = "In parentheses: M3ashy's Table 2, its own models on its own materials."
_KEYS = ["method", "protocol", "metric", "distance"]


def published():
    """Return M3ashy's Table 2: method, metric, distance, value, comparable (False: other units)."""
    with resources.files("neumat.reporting").joinpath("data/m3ashy_table2.csv").open() as file:
        return pd.read_csv(file)


def table2(score_csvs, seed=0, resamples=1000):
    """Return method, protocol, metric, distance, value, low, high, n_ref, n_samples from score files.

    value is the mean over the draws, low and high its 95 % bootstrap interval over the draws (percentile, `resamples`).
    The protocols fold0, fold1, ... become one, `generalisation`: value is the mean over folds and draws, and the
    interval is over both, folds first. So it alone holds the chance of which materials were held out; the others hold
    that of sampling only. n_ref and n_samples say how many materials of a draw were compared, as text: "118 to 122"
    where folds differ. The intervals of all distances resample the same draws. Rows keep the files' order.
    """
    scores = pd.concat([pd.read_csv(path) for path in score_csvs], ignore_index=True)
    scores = scores.assign(fold=scores["protocol"])
    scores["protocol"] = scores["protocol"].str.replace(r"fold\d+", "generalisation", regex=True)
    rows = []
    for keys, group in scores.groupby(_KEYS, sort=False):
        values = group.pivot(index="fold", columns="draw", values="value").to_numpy(float)
        folds, draws = values.shape
        generator = numpy_generator(seed, "bootstrap", *keys[:-1])
        fold = generator.integers(0, folds, (resamples, folds, 1))
        means = values[fold, generator.integers(0, draws, (resamples, folds, draws))].mean((1, 2))
        # By order, not by interpolation: that of two infinite values is not a number.
        low, high = np.quantile(means, [0.025, 0.975], method="nearest")
        rows.append((*keys, values.mean(), low, high, *(_sizes(group[column]) for column in ("n_ref", "n_samples"))))
    return pd.DataFrame(rows, columns=[*_KEYS, "value", "low", "high", "n_ref", "n_samples"])


def table2_markdown(table):
    """Return `table2`'s frame as Markdown: per protocol and metric, methods down, distances across.

    A cell is `value [low, high]`; under `parity` the published figure follows in parentheses where there is one: of
    M3ashy's own models and materials, not of ours.
    """
    lines = []
    for protocol, part in table.groupby("protocol", sort=False):
        pairs = part[["n_ref", "n_samples"]].drop_duplicates()
        sizes = ", ".join(f"{row.n_ref} held-out against {row.n_samples} samples" for row in pairs.itertuples())
        over = "folds and draws" if protocol == "generalisation" else "draws"
        lines += [f"## {protocol}", "", f"{sizes}; mean over {over} [95 % interval over {over}]"]
        lines[-1] += f". {PSNR_NOTE}"
        lines[-1] += f" {PUBLISHED_NOTE}\n" if protocol == "parity" else "\n"
        figures = published() if protocol == "parity" else published().iloc[:0]
        broken = part[(part["metric"] == "nonfinite") & (part["value"] > 0)]
        part = part[part["metric"] != "nonfinite"]
        for metric in [*_TITLES, None]:
            shown = part[part["metric"] == metric] if metric else part[~part["metric"].isin(_TITLES)]
            if len(shown):
                lines += [f"### {_TITLES.get(metric, 'Features of the pictures (lower is better)')}", ""]
                lines += _grid(shown, figures, "distance" if metric else "metric", percent=metric in ("cov", "one_nna"))
        lines += [
            f"{_label(row.method)}: {row.value:.3g} samples a draw were not finite." for row in broken.itertuples()
        ]
        if len(figures):
            missing = "The published MMD on BRDF-L1 is in raw MERL counts: not shown."
            if INCEPTION not in set(part["metric"]):
                missing += " Nor is FID (64 Inception features), which needs `evaluate.inception`."
            lines += [missing, ""]
    return "\n".join(lines)


def _sizes(column):
    low, high = column.min(), column.max()
    return str(low) if low == high else f"{low} to {high}"


def _grid(rows, figures, across, percent):
    """Return the Markdown lines of one table: methods down, the values of column `across` across."""
    columns = list(dict.fromkeys(rows[across]))
    present = list(dict.fromkeys(rows["method"]))
    methods = [name for name in LABELS if name in present] + [name for name in present if name not in LABELS]
    known = figures[figures["comparable"]].set_index(["method", "metric", "distance"])["value"].to_dict()
    cells = {
        (row.method, getattr(row, across)): _cell(row, known.get((row.method, row.metric, row.distance)), percent)
        for row in rows.itertuples()
    }
    lines = ["| method | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for method in methods:
        lines.append(f"| {_label(method)} | " + " | ".join(cells.get((method, c), "") for c in columns) + " |")
    return [*lines, ""]


def _cell(row, figure, percent):
    form = ".1f" if percent else ".3g"
    text = f"{row.value:{form}} [{row.low:{form}}, {row.high:{form}}]"
    return text if figure is None else f"{text} ({figure:{form}})"


def _label(method):
    return LABELS.get(method, method)
