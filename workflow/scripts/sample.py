"""Draw samples from a trained model."""

import time

import h5py

from neumat.files import atomic_path
from neumat.generative.registry import METHODS
from neumat.stage import stage

with stage(snakemake):
    method, sampling = snakemake.wildcards.method, snakemake.params.sampling
    model = METHODS[method].load(snakemake.input[0])
    for key in ("sampler", "nfe"):
        if hasattr(model, key):
            setattr(model, key, sampling[key])
    start = time.perf_counter()
    samples = model.sample(snakemake.params.samples, sampling["seed"])
    seconds = time.perf_counter() - start
    with atomic_path(snakemake.output[0]) as temporary, h5py.File(temporary, "w") as file:
        file["samples"] = samples
        file.attrs.update(method=method, kind=model.kind, stride=model.stride, seed=sampling["seed"], seconds=seconds)
