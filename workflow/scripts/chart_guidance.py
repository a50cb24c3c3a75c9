"""Chart 3: what the guidance scale trades."""

from pathlib import Path

from neumat.brdf.sources import read_sources
from neumat.conditions.prompts import VALIDATION
from neumat.conditions.synthesis import Synthesiser
from neumat.files import atomic_path
from neumat.reporting.request_figures import guidance_chart
from neumat.seeds import seed_for
from neumat.stage import config_file, progress, stage
from neumat.studies.request_bench import Bench
from neumat.studies.request_sweeps import guidance_sweep

with stage(snakemake):
    store, p = snakemake.input, snakemake.params
    paths = dict(store) | {name: config_file(snakemake, f"{name}.tsv") for name in ("types", "prompts")}
    entries = read_sources(store.sources).entries
    bench = Bench(VALIDATION, paths, Synthesiser.load(store.model), entries, p.config["images"], None, p.seed)
    n = max(2, p.config["samples"] // 2)
    table = guidance_sweep(bench, n, p.config["guidances"], seed_for(p.sampling_seed, VALIDATION), progress)
    with atomic_path(snakemake.output.table) as temporary:
        table.to_csv(temporary, index=False)
    guidance_chart(table, p.config["guidance"].values(), Path(snakemake.output.chart))
