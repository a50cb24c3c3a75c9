"""How often answers to the names of things lie within the ranges that they have."""

from neumat.brdf.sources import read_sources
from neumat.conditions.prompts import REPORT
from neumat.conditions.synthesis import Synthesiser
from neumat.conditions.things import read_things
from neumat.files import atomic_path
from neumat.stage import config_file, progress, stage
from neumat.studies.request_bench import Bench
from neumat.studies.things import things_table

with stage(snakemake):
    store, p, c = snakemake.input, snakemake.params, snakemake.params.config
    paths = dict(store) | {name: config_file(snakemake, f"{name}.tsv") for name in ("types", "prompts")}
    entries = read_sources(store.sources).entries
    bench = Bench(REPORT, paths, Synthesiser.load(store.model), entries, 1, None, p.seed)
    things = read_things(config_file(snakemake, "things.tsv"))
    table = things_table(bench, things, c["samples"], c["guidance"], c["candidates"], p.sampling_seed, progress)
    with atomic_path(snakemake.output[0]) as temporary:
        table.to_csv(temporary, index=False)
