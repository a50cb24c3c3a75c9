"""What projection augmentation of texts is worth: models of several powers on the prompts for validation."""

import pandas as pd

from neumat.brdf.sources import read_sources
from neumat.conditions.prompts import VALIDATION
from neumat.conditions.synthesis import Synthesiser
from neumat.files import atomic_path
from neumat.seeds import seed_for
from neumat.stage import config_file, progress, stage
from neumat.studies.request_bench import Bench
from neumat.studies.request_sweeps import text_row

with stage(snakemake):
    store, p = snakemake.input, snakemake.params
    paths = dict(store) | {name: config_file(snakemake, f"{name}.tsv") for name in ("types", "prompts")}
    entries = read_sources(store.sources).entries
    rows = []
    for power, model in progress(list(zip(p.powers, store.models, strict=True))):
        bench = Bench(VALIDATION, paths, Synthesiser.load(model), entries, 1, None, p.seed)
        rows.append({"power": power} | text_row(bench, p.samples, p.guidance, seed_for(p.sampling_seed, VALIDATION)))
    with atomic_path(snakemake.output[0]) as temporary:
        pd.DataFrame(rows).to_csv(temporary, index=False)
