"""How well samples follow their requests, beside null baselines: the table of the rule `conditional`."""

import numpy as np
import pandas as pd

from neumat.conditions.synthesis import scale
from neumat.studies.request_bench import MET

# Answers to a type that are judged, times as many as to other requests: a judge that has not seen the nearest source
# can be had for ten types only, and 480 answers to them leave a standard error of .023.
TYPE_ANSWERS = 6
TYPE_COLUMNS = ["type", "family", "sources", "judged", "right", "unmet", "top1", "top3", "family_accuracy"]


def compare(bench, n, guidance, candidates, seed, progress=iter):
    """Return (rows, types, samples): all measures; those of each type; a list of (Requests, fields (r n, 675)).

    Rows have modality, use (what its requests serve for, see `conditions.prompts`), method, measure, value, materials.
    Methods: "conditional" at `guidance`, {modality: scale}, and
    for texts and images "conditional, best of k", which `Synthesiser.best` chose from k `candidates` for each, as
    samples are served; "null: nearest", by the embedding, and for images "null: nearest appearance", by what is
    predicted from the picture; "null: unconditional" and the same, best of k; "training set", what training materials
    that are right reach. types: `by_type` of the conditional samples, without rows where no type is known.
    """
    rows, samples, model = [], [], bench.synthesiser.model
    types = pd.DataFrame(columns=TYPE_COLUMNS)
    for requests in progress(bench.requests()):
        every = np.repeat(np.arange(len(requests)), n)
        more = n * TYPE_ANSWERS if requests.modality == "type" else n
        belongs = np.repeat(np.arange(len(requests)), more)
        weights, drawn = model.sample(len(belongs), seed, requests.each(more), scale(guidance, requests.encoded))
        answers = {
            "conditional": (weights, belongs),
            "null: nearest": (bench.nearest(requests, n), every),
            "null: unconditional": (model.sample(len(every), seed, {})[0], every),
            "training set": bench.of_training(requests, n),
        }
        if requests.shown is not None:
            alike = bench.synthesiser.alike(requests.encoded["image"])[:, :n]
            answers["null: nearest appearance"] = bench.synthesiser.weights[alike].flatten(0, 1), every
        served = weights
        if requests.modality != "type" and candidates > 1:
            best, _ = bench.synthesiser.answers(requests.encoded, n, seed, guidance, candidates)
            served = best.flatten(0, 1)
            answers[f"conditional, best of {candidates}"] = served, every
            many, _ = model.candidates(len(every) * candidates, seed, {})
            best = bench.synthesiser.best(many.view(len(requests), n * candidates, -1), requests.encoded, n)
            answers[f"null: unconditional, best of {candidates}"] = best.flatten(0, 1), every
        samples.append((requests, served))
        label = requests.modality, requests.use
        for method, (fields, whose) in answers.items():
            if len(fields):
                for measure, (value, count) in bench.judge(requests, fields, whose).items():
                    rows.append((*label, method, measure, value, count))
        rows.append((*label, "conditional", "drawn anew", drawn - len(weights), len(weights)))
        if requests.modality == "type":
            types = by_type(*(bench.by_type(requests, weights, belongs, unseen) for unseen in (False, True)))
    return pd.DataFrame(rows, columns=["modality", "use", "method", "measure", "value", "materials"]), types, samples


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
