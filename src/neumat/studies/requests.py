"""How well samples follow their requests, beside null baselines: the table of the rule `conditional`."""

import numpy as np
import pandas as pd

from neumat.conditions.synthesis import scale
from neumat.seeds import numpy_generator
from neumat.studies.request_bench import MET

# Answers to a type that are judged, times as many as to other requests: a judge that has not seen the nearest source
# can be had for ten types only, and 480 answers to them leave a standard error of .023.
TYPE_ANSWERS = 6
SERVED = "served, best of"  # and the number of candidates: what is served
BOTH = "colour and gloss right"
RESAMPLED = 2000  # times, of the bootstrap
COLUMNS = ["modality", "use", "method", "measure", "value", "low", "high", "materials"]
TYPE_COLUMNS = ["type", "family", "sources", "judged", "right", "unmet", "top1", "top3", "family_accuracy"]


def compare(bench, n, guidance, candidates, seed, progress=iter):
    """Return (rows, types, samples): all measures; those of each type; a list of (Requests, fields (r n, 675)).

    Rows have modality, use (what its requests serve for, see `conditions.prompts`), method, measure, value, low, high
    (where a bootstrap over the requests gives them, 95 %), materials. Methods: "conditional" at `guidance`,
    {modality: scale}; for texts and images "served, best of k": of k `candidates` for each, variants of training
    materials (see `Synthesiser.start`) in the wanted colours, the best; the look-ups by the same score, see
    `Bench.looked_up`; "null: unconditional"; "training set", what training materials that are right reach. types:
    `by_type` of the conditional samples, without rows where no type is known.
    """
    rows, samples, model = [], [], bench.synthesiser.model
    types = pd.DataFrame(columns=TYPE_COLUMNS)
    for requests in progress(bench.requests()):
        every = np.repeat(np.arange(len(requests)), n)
        more = n * TYPE_ANSWERS if requests.modality == "type" else n
        belongs = np.repeat(np.arange(len(requests)), more)
        weights, drawn = model.sample(len(belongs), seed, requests.each(more), scale(guidance, requests.encoded))
        answers = {"conditional": (weights, belongs)}
        served = weights
        if requests.modality != "type" and candidates > 1:
            best, _ = bench.synthesiser.answers(requests.encoded, n, seed, guidance, candidates)
            served = best.flatten(0, 1)
            answers[f"{SERVED} {candidates}"] = served, every
        for method, fields in bench.looked_up(requests, n, candidates).items():
            answers[method] = fields, every
        answers["null: unconditional"] = model.sample(len(every), seed, {})[0], every
        answers["training set"] = bench.of_training(requests, n)
        samples.append((requests, served))
        label = requests.modality, requests.use
        for method, (fields, whose) in answers.items():
            if len(fields):
                for measure, (value, count) in bench.judge(requests, fields, whose).items():
                    rows.append((*label, method, measure, value, np.nan, np.nan, count))
        if requests.modality == "text":
            rows += [(*label, *row) for row in both_right(bench, requests, answers)]
        rows.append((*label, "conditional", "drawn anew", drawn - len(weights), np.nan, np.nan, len(weights)))
        if requests.modality == "type":
            types = by_type(*(bench.by_type(requests, weights, belongs, unseen) for unseen in (False, True)))
    return pd.DataFrame(rows, columns=COLUMNS), types, samples


def both_right(bench, requests, answers):
    """Return rows (method, measure, value, low, high, answers) of the share of answers of which colour and gloss are
    right, {method: (fields, the requests they belong to)}: the mean over the prompts, with its interval; and of what is
    served less each look-up, on the same prompts."""
    shares = {
        method: bench.both_right(requests, fields, whose) for method, (fields, whose) in answers.items() if len(fields)
    }
    rows = [(method, BOTH, *interval(share), len(answers[method][0])) for method, share in shares.items() if len(share)]
    for served in (method for method in shares if method.startswith(SERVED)):
        for other in (method for method in shares if method.startswith("look-up")):
            gain = (shares[served] - shares[other]).dropna()
            if len(gain):
                rows.append((served, f"{BOTH}, less {other}", *interval(gain), len(answers[served][0])))
    return rows


def interval(values):
    """Return (mean, low, high) of values (n,), one a request: the 95 % interval by a bootstrap over them."""
    values = np.asarray(values, float)
    drawn = numpy_generator(0, "requests").integers(len(values), size=(RESAMPLED, len(values)))
    return values.mean(), *np.quantile(values[drawn].mean(1), (0.025, 0.975))


def by_type(seen, unseen):
    """Return the `accuracies` of each type by a judge that knows all sources (right, the share of the answers that are
    of the type) and by one that has not seen the nearest (top1, top3, family_accuracy).

    unmet is 1 where fewer than MET of the answers are right. A last row, "all types", holds the numbers of sources, of
    judged answers and of unmet types, and the means of the shares over the types.
    """
    table = unseen.copy()
    table.insert(4, "right", seen["top1"])
    table.insert(5, "unmet", (table["right"] < MET).astype(int))
    counts = ["sources", "judged", "unmet"]
    everything = table.mean(numeric_only=True).to_dict() | table[counts].sum().to_dict() | {"type": "all types"}
    return pd.concat([table, pd.DataFrame([everything])]).astype(dict.fromkeys(counts, int)).fillna({"family": ""})
