"""How well samples follow their requests, beside null baselines: the table of the rule `conditional`."""

import numpy as np
import pandas as pd

from neumat.conditions.synthesis import scale

# Answers to a type that are judged, times as many as to other requests: a judge that has not seen the nearest source
# can be had for ten types only, and their 120 answers leave a standard error of .045.
TYPE_ANSWERS = 4


def compare(bench, n, guidance, candidates, seed, progress=iter):
    """Return (rows, types, samples): all measures; those of each type; {modality: (Requests, fields (r n, 675))}.

    Rows have modality, method, measure, value, materials. Methods: "conditional" at `guidance`, {modality: scale}, and
    for texts and images "conditional, best of k", which `Synthesiser.best` chose from k `candidates` for each, as
    samples are served; "null: nearest", by the embedding, and for images "null: nearest look", by what `Looks` tells
    from the picture; "null: unconditional" and the same, best of k; "training set", what training materials that are
    right reach. types: `accuracies` of the conditional samples, by a judge that knows all sources (top1_seen) and by
    one that has not seen the nearest.
    """
    rows, samples, model = [], {}, bench.synthesiser.model
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
            answers["null: nearest look"] = bench.synthesiser.weights[alike].flatten(0, 1), every
        samples[requests.modality] = requests, weights
        if requests.modality != "type" and candidates > 1:
            for method, given in (("conditional", requests.encoded), ("null: unconditional", {})):
                fields = _chosen(bench.synthesiser, requests, given, n, guidance, candidates, seed)
                answers[f"{method}, best of {candidates}"] = fields, every
            samples[requests.modality] = requests, answers[f"conditional, best of {candidates}"][0]
        for method, (fields, asked) in answers.items():
            if len(fields):
                for measure, (value, count) in bench.judge(requests, fields, asked).items():
                    rows.append((requests.modality, method, measure, value, count))
        rows.append((requests.modality, "conditional", "drawn anew", drawn - len(weights), len(weights)))
        if requests.modality == "type":
            types, seen = (bench.by_type(requests, weights, belongs, unseen) for unseen in (True, False))
            types.insert(4, "top1_seen", seen["top1"])
    return pd.DataFrame(rows, columns=["modality", "method", "measure", "value", "materials"]), types, samples


def _chosen(synthesiser, requests, given, n, guidance, candidates, seed):
    """Return the answers (r n, 675) to requests that are chosen from `candidates` for each, drawn for what is `given`,
    {modality: rows (r, size), as encoded}: perhaps nothing."""
    asked = {name: rows.repeat_interleave(n * candidates, 0) for name, rows in synthesiser.embed(given).items()}
    start = synthesiser.start(given, n, candidates)
    drawn, _ = synthesiser.model.sample(len(requests) * n * candidates, seed, asked, scale(guidance, given), start)
    return synthesiser.best(drawn.view(len(requests), n * candidates, -1), requests.encoded, n).flatten(0, 1)
