"""Statistics of every material over the whole grid: the fields of AugMERL, and the measured tables."""

from neumat.brdf.sources import read_sources
from neumat.brdf.statistics import source_statistics
from neumat.fields.statistics import neumerl_statistics
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path
from neumat.stage import progress, stage

with stage(snakemake):
    store, f_diffuse = snakemake.input, snakemake.params.f_diffuse
    fields = neumerl_statistics(read_neumerl(store.neumerl), f_diffuse, progress)
    sources = source_statistics(read_sources(store.sources), f_diffuse, progress)
    for table, path in ((fields, snakemake.output.fields), (sources, snakemake.output.sources)):
        with atomic_path(path) as temporary:
            table.to_csv(temporary, index=False)
