"""Draw what every method synthesises from an exemplar beside a larger patch of the surface."""

from neumat.btf.store import read_btf
from neumat.reporting.btf_figures import load_fitted, synthesis_figure
from neumat.stage import stage

with stage(snakemake):
    store, params, extent = snakemake.input, snakemake.params, int(snakemake.wildcards.extent)
    (model,), brightness = load_fitted([store.model], store.queries)
    truth = read_btf(store.truth)
    synthesis_figure(model, params.methods, truth, extent, brightness, params.seed, snakemake.output[0])
