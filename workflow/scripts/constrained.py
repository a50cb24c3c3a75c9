"""Search the samples of the diffusion model for materials of one category."""

import logging
import time

from neumat.generative.constrained import InCategory, constrained_samples, summary, write_found
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.seeds import seed_for
from neumat.stage import progress, stage

with stage(snakemake):
    category, sampling, c = snakemake.wildcards.category, snakemake.params.sampling, snakemake.params.constrained
    model = HyperDiffusion.load(snakemake.input[0])
    model.sampler, model.nfe = sampling["sampler"], sampling["nfe"]
    accept = InCategory(category, c["rules"])
    seed = seed_for(sampling["seed"], "constrained", category)
    start = time.perf_counter()
    with progress(total=c["materials"]) as bar:
        found = constrained_samples(model.sample, accept, c["materials"], c["budget"], c["batch"], seed, bar.update)
    seconds = time.perf_counter() - start
    logging.info(summary(category, found, c["materials"]))
    write_found(snakemake.output[0], category, "rejection", found, c["materials"], seconds, seed)
