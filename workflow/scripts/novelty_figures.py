"""The first samples beside their nearest training materials, and the heat map of distances to the held-out ones."""

from neumat.metrics.distances import between
from neumat.metrics.novelty import nearest_training
from neumat.reporting.figures import heat_map, nearest_figure
from neumat.stage import stage
from neumat.studies.protocols import Protocol

SHOWN = 36

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    protocol = Protocol(
        "parity", store.neumerl, store.manifest, store.sources, params.entries, params.size, params.seed
    )
    samples = protocol.samples(store.samples, pictures=False)[: params.set_size]
    _, nearest = nearest_training(samples[:SHOWN], protocol.materials(protocol.train, False), "brdf_l1_log")
    shown = protocol.samples(store.samples)[:SHOWN].images
    nearest_figure(shown, protocol.materials(protocol.train[nearest]).images, snakemake.output.nearest)
    reference = protocol.materials(protocol.reference, pictures=False)
    heat_map(between("msl", reference, samples), snakemake.output.heatmap, unit="mean squared log distance")
