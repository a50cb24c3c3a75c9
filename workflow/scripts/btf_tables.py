"""Put the tables of all surfaces together."""

import pandas as pd

from neumat.files import atomic_path
from neumat.stage import stage

with stage(snakemake):
    for name, path in snakemake.output.items():
        table = pd.concat([pd.read_csv(part) for part in snakemake.input[name]], ignore_index=True)
        with atomic_path(path) as temporary:
            table.to_csv(temporary, index=False)
