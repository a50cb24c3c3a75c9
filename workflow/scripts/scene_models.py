"""The cheapest models that keep a scene within each tolerance, and fits under its own queries."""

from neumat.augment.store import AugMerl
from neumat.files import atomic_path
from neumat.scenes.materials import Materials, stored_tables
from neumat.scenes.model_selection import ModelSelection, layout_materials
from neumat.stage import progress, stage

with stage(snakemake):
    store, params = snakemake.input, snakemake.params
    found = layout_materials(params.layout, Materials(store.neumerl, store.manifest, store.samples))
    names = {name for name, _ in found.values()}
    tables = stored_tables(names, store.manifest, AugMerl(store.augmerl, store.sources))
    needs = ModelSelection(params.layout, found, tables, params.settings, params.seed, progress)
    for table, path in ((needs.table(), snakemake.output.models), (needs.fits(), snakemake.output.fits)):
        table.insert(0, "scene", snakemake.wildcards.scene)
        with atomic_path(path) as temporary:
            table.to_csv(temporary, index=False)
