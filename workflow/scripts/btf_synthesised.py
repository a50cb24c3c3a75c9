"""Draw what every method synthesises from an exemplar, beside a larger patch of the surface where there is one."""

from neumat.btf.pairs import given_pairs
from neumat.btf.store import read_btf
from neumat.reporting.btf_figures import load_fitted, synthesis_figure
from neumat.stage import stage

with stage(snakemake):
    store, params, extent = snakemake.input, snakemake.params, int(snakemake.wildcards.extent)
    (model,), brightness = load_fitted([store.model], store.queries)
    truth = read_btf(store.truth) if store.truth else None
    tileable, pairs = read_btf(store.queries).tileable, given_pairs(params.pairs)
    out = snakemake.output[0]
    synthesis_figure(model, params.methods, pairs, tileable, extent, brightness, params.seed, out, truth)
