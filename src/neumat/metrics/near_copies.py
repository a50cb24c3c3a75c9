"""How many samples are near copies of training materials: the summary of what `neumat.metrics.novelty` measures."""

import pandas as pd

HELD_OUT, SAMPLES = "held-out", "samples"
NEAR_COPY_QUANTILE = 0.05


def novelty_summary(rows):
    """Return one row per method, protocol and distance of `novelty` rows: the medians of the distances to training
    of samples and of held-out materials, and the share of near copies in percent, which are the samples no farther
    from training than the nearest 5 % of the held-out (the threshold)."""
    summary = []
    for (method, protocol, distance), group in rows.groupby(["method", "protocol", "distance"], sort=False):
        held_out = group.loc[group["set"] == HELD_OUT, "value"]
        samples = group.loc[group["set"] == SAMPLES, "value"]
        threshold = held_out.quantile(NEAR_COPY_QUANTILE)
        summary.append(
            {
                "method": method,
                "protocol": protocol,
                "distance": distance,
                "median": samples.median(),
                "held_out_median": held_out.median(),
                "threshold": threshold,
                "near_copies_percent": 100 * (samples <= threshold).mean(),
                "n_samples": len(samples),
                "n_held_out": len(held_out),
            }
        )
    return pd.DataFrame(summary)
