"""Draw every representation's pictures of a surface, and two of them tiled and synthesised."""

from neumat.btf.pairs import given_pairs
from neumat.btf.store import read_btf
from neumat.reporting.btf_figures import fits_figure, load_fitted, tiled_and_synthesised_figure
from neumat.stage import stage

with stage(snakemake):
    store, params, output = snakemake.input, snakemake.params, snakemake.output
    models, brightness = load_fitted(store.models, store.queries)
    models = dict(zip(params.names, models, strict=True))
    held_out, pairs = read_btf(store.held_out), given_pairs(params.pairs)
    fits_figure(models, held_out, len(params.pairs), brightness, output.fits)
    shown = {name: models[name] for name in ("ours", "neumip") if name in models}
    about = held_out.tileable, brightness, params.seed
    tiled_and_synthesised_figure(shown, params.method, pairs, *about, params.extent, output.tiled)
