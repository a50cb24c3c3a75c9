"""Search the samples of the diffusion model, asked for the category or not, for materials of one category."""

import functools
import logging
import time

from neumat.conditions.synthesis import Synthesiser
from neumat.generative.constrained import InCategory, constrained_samples, summary, write_found
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.seeds import seed_for
from neumat.stage import progress, stage

with stage(snakemake):
    category, sampling, c = snakemake.wildcards.category, snakemake.params.sampling, snakemake.params.constrained
    if snakemake.wildcards.way:
        way, synthesiser = "guided", Synthesiser.load(snakemake.input[0])
        request = synthesiser.request(category=category)
        sampler = functools.partial(synthesiser.model.draw, request=request, guidance=snakemake.params.guidance)
    else:
        way, model = "rejection", HyperDiffusion.load(snakemake.input[0])
        model.sampler, model.nfe = sampling["sampler"], sampling["nfe"]
        sampler = model.draw
    accept = InCategory(category, c["rules"])
    seed = seed_for(sampling["seed"], "constrained", category)
    start = time.perf_counter()
    with progress(total=c["materials"]) as bar:
        found = constrained_samples(sampler, accept, c["materials"], c["budget"], c["batch"], seed, bar.update)
    seconds = time.perf_counter() - start
    logging.info(summary(category, found, c["materials"]))
    write_found(snakemake.output[0], category, way, found, c["materials"], seconds, seed)
