"""Draw the default fit of a surface: its planes, its pictures beside captured ones, and enlargements."""

from neumat.btf.pairs import given_pairs
from neumat.btf.store import read_btf
from neumat.reporting.btf_figures import enlargements_figure, fits_figure, load_fitted, planes_figure
from neumat.stage import stage

with stage(snakemake):
    store, params, output = snakemake.input, snakemake.params, snakemake.output
    (model,), brightness = load_fitted([store.model], store.queries)
    held_out, pairs = read_btf(store.held_out), given_pairs(params.pairs)
    planes_figure(model, output.planes)
    fits_figure({"ours": model}, held_out, len(params.pairs), brightness, output.fits)
    enlargements_figure(model, params.method, pairs, held_out.tileable, brightness, params.seed, output.endless)
