"""The data card of the packaged model: what it is, and the figures of models of the same recipe."""

from importlib.resources import files

from neumat.reporting.coverage import COPIES, MODEL, OWN
from neumat.reporting.markdown import frame_markdown

COVERAGE = ["method", "coverage", "low", "high", "of_copies", "precision", "novelty", "valid"]
EMPTY = "They are put here by `make packaged`."


def model_card(facts, coverage=None, conditional=None):
    """Return the card as Markdown.

    facts: size (MB), sources, blends, dense (how many more bases), mixing (see HyperDiffusion), coordinates, steps,
    tuning. coverage, conditional: the tables of these names, DataFrames; None for a card without figures.
    """
    template = files("neumat.reporting").joinpath("data/model.md").read_text(encoding="utf-8")
    dense = f", and {facts['dense']} bases of the dense set" if facts["dense"] else ""
    mixtures = "" if facts["mixing"] is None else ", learnt as mixtures that are drawn anew in every step,"
    figures = EMPTY if coverage is None else f"{_unseen(coverage)}\n\n{_requests(conditional)}"
    return template.format(**facts | {"dense": dense, "mixtures": mixtures}, figures=figures)


def _unseen(coverage):
    """Return the part on samples, from the table `coverage`."""
    largest = int(coverage["size"].max())
    last = (coverage["size"] == largest) & coverage["method"].isin([MODEL, COPIES]) & (coverage["level"] == 0)
    rows = coverage[last | (coverage["method"] == OWN)]
    return (
        f"Samples, means over {rows['folds'].iloc[0]}, of held-out sources. `coverage` is the mean distance of a "
        f"held-out source to the nearest of {largest} samples (BRDF log-L1, its 95 % interval from `low` to `high`), "
        "`of_copies` as a share of that of copies of the training set; `precision` the median distance of a sample to "
        "the nearest real material, `novelty` that to the nearest source of the training set. `held-out`: the same of "
        f"the held-out sources themselves.\n\n{frame_markdown(rows[COVERAGE])}"
    )


def _requests(conditional):
    """Return the part on requests, from the table `conditional`."""
    rows = conditional[conditional["use"] == "report"]
    table = rows.pivot_table("value", ["modality", "measure"], "method", sort=False).reset_index()
    return (
        "Answers to requests, by judges that share nothing with the encoders or the model but the definitions of words "
        "for colour and gloss, beside those of a look-up by the same score (`look-up: ...`)."
        f"\n\n{frame_markdown(table)}"
    )
