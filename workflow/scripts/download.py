"""Download and verify the MERL files; an interrupted download resumes."""

import pandas as pd

from neumat.brdf.download import download_merl
from neumat.brdf.published import merl_checksums
from neumat.files import atomic_path
from neumat.stage import progress, stage

with stage(snakemake):
    checksums = merl_checksums()
    names = snakemake.params.names or list(checksums)
    paths = download_merl(names, snakemake.params.url, snakemake.params.folder, checksums, progress)
    with atomic_path(snakemake.output[0]) as temporary:
        rows = [(path.name, *checksums[name]) for name, path in zip(names, paths, strict=True)]
        pd.DataFrame(rows, columns=["file", "sha256", "bytes"]).to_csv(temporary, sep="\t", index=False)
