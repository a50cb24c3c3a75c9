"""Compare a fitted BTF with captured pictures that it has not seen."""

import pandas as pd

from neumat.files import atomic_path
from neumat.stage import stage
from neumat.studies.btf_quality import quality

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    counts = {name: params.held_out[name] for name in ("validation", "report")}
    rows = quality(store.model, store.queries, store.held_out, counts, params.seed)
    rows.insert(0, "surface", snakemake.wildcards.surface)
    rows = rows.merge(pd.read_csv(store.cost), how="cross")
    with atomic_path(snakemake.output[0]) as temporary:
        rows.to_csv(temporary, index=False)
