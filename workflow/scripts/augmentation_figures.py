"""The six permutations of one material, and a blend of two in PCA space and in BRDF space."""

from neumat.augment.store import AugMerl
from neumat.render.sphere import FrozenSphere
from neumat.reporting import augmentation_figures as figures
from neumat.stage import stage

with stage(snakemake):
    store = AugMerl(snakemake.input.augmerl, snakemake.input.sources)
    names, frozen = store.sources.names, FrozenSphere(snakemake.params.size)
    permuted, pair = figures.chosen_materials(store.sources)
    pictures = figures.permuted_pictures(store, frozen, permuted)
    figures.permutation_figure(pictures, names[permuted], snakemake.output.permutations)
    blends = figures.blended_pictures(store, frozen, *pair)
    figures.blend_figure(blends, [names[i] for i in pair], snakemake.output.blends)
