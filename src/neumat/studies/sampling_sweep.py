"""Chart 2: what samples cost and how good they are, over samplers and evaluations, and over training steps."""

import time
from dataclasses import replace

import pandas as pd

from neumat.generative.samplers import SAMPLERS
from neumat.metrics.score import Scorer

DISTANCES = ("brdf_l1", "brdf_l1_log", "rmse", "neg_psnr")


def sweep(protocol, dataset, model, nfes, shares, draws, size, seed, progress=iter):
    """Return a DataFrame: family, label, train_seconds, sample_seconds, metric, distance, value (mean over the draws).

    protocol: see `neumat.studies.protocols`; dataset: its training side; model: an unfitted HyperDiffusion whose
    sampler and nfe are the default. It is trained with each of `shares` of its steps and then sampled as it is;
    trained in full, it is sampled by every sampler with each of `nfes` evaluations. Seconds are of this run and of
    draws * size samples, as the sampler leaves them.
    """
    trained = [
        ("training", f"{share:g} of the steps", replace(model, steps=max(1, round(share * model.steps))))
        for share in sorted({*shares, 1.0})
    ]
    settings = {(sampler, nfe) for sampler in SAMPLERS for nfe in nfes} | {(model.sampler, model.nfe)}
    scorer = Scorer(protocol.materials(protocol.reference), protocol.name, protocol.seed, {}, DISTANCES)
    rows = []

    def measure(family, label, fitted, train_seconds):
        start = time.perf_counter()
        samples = fitted.draw(draws * size, seed)
        seconds = time.perf_counter() - start
        scores = scorer.score(protocol.fields(samples), draws, label)
        means = scores.groupby(["metric", "distance"], sort=False)["value"].mean().reset_index()
        rows.append(means.assign(family=family, label=label, train_seconds=train_seconds, sample_seconds=seconds))

    for family, label, unfitted in progress(trained):
        start = time.perf_counter()
        fitted = unfitted.fit(dataset, seed)
        train_seconds = time.perf_counter() - start
        measure(family, label, fitted, train_seconds)
    for sampler, nfe in progress(sorted(settings)):
        fitted.sampler, fitted.nfe = sampler, nfe
        measure(sampler, f"{sampler} {nfe}", fitted, train_seconds)
    columns = ["family", "label", "train_seconds", "sample_seconds", "metric", "distance", "value"]
    return pd.concat(rows, ignore_index=True)[columns]
