"""How well conditional samples follow their requests, by modality and by type; M3ashy's Figs. 7 to 9."""

import json

import h5py

from neumat.brdf.sources import read_sources
from neumat.conditions.prompts import REPORT
from neumat.conditions.synthesis import Synthesiser
from neumat.files import atomic_path
from neumat.reporting.conditional import FIGURES, write_figures
from neumat.stage import config_file, progress, stage
from neumat.studies.request_bench import Bench
from neumat.studies.requests import compare

with stage(snakemake):
    store, p, output = snakemake.input, snakemake.params, snakemake.output
    synthesiser = Synthesiser.load(store.model)
    paths = dict(store) | {name: config_file(snakemake, f"{name}.tsv") for name in ("types", "prompts")}
    entries = read_sources(store.sources).entries
    bench = Bench(REPORT, paths, synthesiser, entries, p.config["images"], store.measured, p.seed)
    c = p.config
    table, types, samples = compare(bench, c["samples"], c["guidance"], c["candidates"], p.sampling_seed, progress)
    for rows, path in ((table, output.table), (types, output.types)):
        with atomic_path(path) as temporary:
            rows.to_csv(temporary, index=False)
    with atomic_path(output.samples) as temporary, h5py.File(temporary, "w") as file:
        for requests, weights in samples:
            group = file.create_group(f"{requests.modality}/{requests.use}")
            group["requests"], group["samples"] = requests.names, weights.numpy()
        file.attrs.update(guidance=json.dumps(p.config["guidance"]), seed=p.sampling_seed)
    write_figures(samples, p.size, p.spp, {modality: output[modality] for modality in FIGURES})
