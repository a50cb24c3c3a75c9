"""The headline figures of a run, each beside its null and its ceiling."""

import pandas as pd

from neumat.reporting.coverage import verdict
from neumat.reporting.markdown import frame_markdown
from neumat.tables import read_table

_ABSENT = "–"
_BEST = "served, best"  # of several candidates: what requests return
# What looking up is called: among the training materials, and among these in the wanted colours.
_LOOK_UPS = {"looked up": "look-up: training", "looked up and recoloured": "look-up: recoloured training"}
# Of requests: modality, judge's measure, method, format, words.
_REQUESTS = (
    ("text", "colour and gloss right", _BEST, ".2f", "text: colour and gloss right, share of answers"),
    ("text", "colour right", _BEST, ".2f", "text: colour right, share of answers"),
    ("text", "gloss right", _BEST, ".2f", "text: gloss right, share of answers"),
    ("image", "RMSE under new light", _BEST, ".4f", "picture: RMSE under new light"),
    ("type", "type right, judge has not seen it", "conditional", ".2f", "type: right, share of answers"),
)


def headline(results):
    """Return the headline figures of the run in the folder `results` as Markdown: a sentence on the frontier, a table.

    A figure that the run did not make is said to be no part of it.
    """
    table = {
        name: read_table(path) if (path := results / f"{name}.csv").is_file() else pd.DataFrame()
        for name in (
            "tables/fit-summary",
            "tables/ladder",
            "tables/unconditional",
            "tables/coverage",
            "tables/generalisation",
            "tables/conditional",
            "tables/constrained",
            "charts/models",
        )
    }
    covered = table["tables/coverage"]
    rows = [
        *_coverage(covered),
        *_fits(table["tables/fit-summary"], table["tables/ladder"]),
        *_unconditional(table["tables/unconditional"]),
        _generalisation(table["tables/generalisation"]),
        *_requests(table["tables/conditional"]),
        _category(table["tables/constrained"]),
        _scene_models(table["charts/models"]),
    ]
    rows = [row if row[1] != _ABSENT else (row[0], "not part of this run", "", "") for row in rows]
    shown = frame_markdown(pd.DataFrame(rows, columns=["figure", "neumat", "null", "ceiling"]))
    return f"{verdict(covered)}\n\n{shown}" if len(covered) else shown


def _value(table, form, column="value", **keys):
    """Return the value of the first row of `table` with `keys`, formatted; – without such a row."""
    for key, value in keys.items():
        table = table[table[key] == value] if key in table else table.iloc[:0]
    if len(table) == 0 or pd.isna(table[column].iloc[0]):
        return _ABSENT
    return format(table[column].iloc[0], form)


def _fits(table, ladder):
    """Rendered PSNR of the fitted materials, and of measured ones that no setting was chosen on."""
    null = "; ".join(
        f"{ladder[ladder['rung'] == rung]['psnr'].median():.0f} ({words})"
        for rung, words in (("lambert", "Lambert"), ("sgd", "SGD"))
        if len(ladder)
    )
    fitted, measured = (
        _value(table, ".1f", "median", set=name, quantity="psnr") for name in ("fitted", "measured, reporting")
    )
    yield "fits: rendered PSNR, median, dB", fitted, null, ""
    yield "the same of measured materials", "not measured" if measured == _ABSENT else measured, "", ""


def _unconditional(table):
    for metric, distance, words in (
        ("one_nna", "brdf_l1", "1-NNA by BRDF-L1 under `parity`, % (50 is best)"),
        ("one_nna", "neg_ssim", "1-NNA by SSIM under `parity`, % (50 is best)"),
        ("cov", "brdf_l1", "COV by BRDF-L1 under `parity`, % (higher is better)"),
    ):
        ours, copies, blends, best = (
            _value(table, ".1f", method=method, protocol="parity", metric=metric, distance=distance)
            for method in ("hyperdiffusion", "copies", "interpolations", "training-set")
        )
        yield words, ours, f"{copies} (copies), {blends} (interpolations)", f"{best} (training set)"


def _coverage(table):
    """Coverage, precision and novelty over the folds that no setting was chosen on, at the largest number of samples.

    The null of coverage is what copies reach, that of precision fresh blends of all shares.
    """
    if len(table):
        table = table[table["size"].isna() | (table["size"] == table["size"].max())]
    ours, copies, blends, own = (
        {"method": method, **({"level": level} if level is not None else {})}
        for method, level in (("hyperdiffusion", 0), ("copies", 0), ("blends", 1), ("held-out", None))
    )
    covered, copied, blended = (_value(table, ".4f", "coverage", **keys) for keys in (ours, copies, blends))
    yield "unseen sources to the nearest of the samples, mean", covered, f"{copied} (copies), {blended} (blends)", ""
    for column, words in (
        ("precision", "samples to the nearest real material, median"),
        ("novelty", "samples to the nearest training source, median"),
        ("novelty, any tint", "the same after the best gain of each channel"),
    ):
        found, null, real = (_value(table, ".4f", column, **keys) for keys in (ours, blends, own))
        yield words, found, f"{null} (blends)", f"{real} (unseen sources)"


def _generalisation(table):
    ours, copies, best = (
        _value(table, ".1f", method=method, protocol="generalisation", metric="one_nna", distance="brdf_l1")
        for method in ("hyperdiffusion", "copies", "training-set")
    )
    return "1-NNA by BRDF-L1 over held-out sources, %", ours, f"{copies} (copies)", f"{best} (training set)"


def _requests(table):
    """Requests that no setting was chosen on. What is shown to be made has no relative among the training materials, so
    that none of these is a ceiling for pictures."""
    if len(table):
        table = table.assign(method=table["method"].str.replace(r"best of \d+", "best", regex=True))
    for modality, measure, method, form, words in _REQUESTS:
        found = {
            name: _value(table, form, modality=modality, use="report", measure=measure, method=name)
            for name in (method, "null: unconditional", *_LOOK_UPS.values(), "training set")
        }
        nulls = [f"{found['null: unconditional']} (no request)"]
        nulls += [f"{found[name]} ({way})" for way, name in _LOOK_UPS.items()]
        yield words, found[method], ", ".join(nulls), found["training set"] if modality != "image" else ""


def _category(table):
    ours, null = (
        format(table[table["way"] == way]["acceptance"].median(), ".2f") if len(table) else _ABSENT
        for way in ("guided", "rejection")
    )
    return "category: share of draws in it, median", ours, f"{null} (no request)", "1"


def _scene_models(table):
    tolerance = 0.02
    share = table[table["tolerance"] == tolerance]["bytes_share"] if len(table) else table
    ours = format(share.median(), ".2f") if len(share) else _ABSENT
    return f"bytes of a scene's models at mean FLIP {tolerance}, median share", ours, "1 (675 weights everywhere)", ""
