"""What one setting changes in how well requests are met: the guidance scale, the encoding of texts.

Settings are chosen on these sweeps, so their Bench is one for validation; its side is a column of the tables.
"""

import numpy as np
import pandas as pd

from neumat.fields.validity import physical
from neumat.studies.request_bench import LOOK_UP

COLUMNS = {
    "type_right": ("type", "type right, judge has not seen it"),
    "colour_right": ("text", "colour right"),
    "gloss_right": ("text", "gloss right"),
    "image_rmse": ("image", "RMSE under new light"),
}


def guidance_sweep(bench, n, guidances, seed, progress=iter):
    """Return a DataFrame with a row for each guidance scale: what `draw` gives, the invalid left out but counted.

    Columns: use (the bench's side), guidance, type_right (judge has not seen it), colour_right, gloss_right,
    image_rmse, diversity (mean over the modalities), nearest (median distance to training), invalid (share).
    """
    rows, model = [], bench.synthesiser.model
    everything = bench.requests()
    for guidance in progress(guidances):
        found, invalid, total = {}, 0, 0
        for requests in everything:
            every = np.repeat(np.arange(len(requests)), n)
            weights = model.draw(len(every), seed, requests.each(n), guidance)
            good = physical(weights)
            invalid, total = invalid + int((~good).sum()), total + len(good)
            if good.any():
                found[requests.modality] = bench.judge(requests, weights[good], every[good.numpy()])
        rows.append({"use": bench.side, "guidance": guidance} | _summary(found) | {"invalid": invalid / total})
    return pd.DataFrame(rows)


def _summary(found):
    row = {
        name: found[modality][measure][0] if modality in found else np.nan
        for name, (modality, measure) in COLUMNS.items()
    }
    for name, measure in (("diversity", "diversity"), ("nearest", "nearest training")):
        row[name] = np.mean([judged[measure][0] for judged in found.values()]) if found else np.nan
    return row


def text_row(bench, n, guidance, seed):
    """Return {"use": the bench's side, measure: value} of n samples for each prompt, and of as many
    training materials that are looked up."""
    requests = next(requests for requests in bench.requests() if requests.modality == "text")
    every = np.repeat(np.arange(len(requests)), n)
    weights, _ = bench.synthesiser.model.sample(len(every), seed, requests.each(n), guidance)
    row = {measure: value for measure, (value, _) in bench.judge(requests, weights, every).items()}
    found = bench.look_up.answers(requests.encoded, n, 1).flatten(0, 1)
    found = bench.judge(requests, found, every)
    return {"use": bench.side} | row | {f"{LOOK_UP}, {measure}": value for measure, (value, _) in found.items()}
