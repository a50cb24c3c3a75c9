"""The first samples of every method, none picked, below held-out materials."""

from neumat.augment.manifest import protocol_indices, read_manifest
from neumat.brdf.sources import read_sources
from neumat.fields.store import read_neumerl
from neumat.render.sphere import FrozenSphere, render_fields
from neumat.reporting.method_sheet import method_sheet, sample_pictures
from neumat.stage import stage

COUNT = 16

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    frozen = FrozenSphere(params.size)
    _, reference = protocol_indices(read_manifest(store.manifest), "parity")
    held_out = render_fields(frozen, read_neumerl(store.neumerl).weights[reference[:COUNT]])
    pictures = sample_pictures(store.samples, COUNT, read_sources(store.sources), frozen)
    method_sheet(["held-out materials", *params.methods], [held_out, *pictures], snakemake.output[0])
