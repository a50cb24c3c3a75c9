"""Tables of the workflow, written by pandas and read back letter for letter."""

from pathlib import Path

import pandas as pd

from neumat.files import reading

# Columns of names that users give, and of texts made of them: "001" is no number there, and "NA" is not missing.
NAMES = ("name", "base", "parent_a", "parent_b", "parent_c", "material", "worst_material", "object", "scene", "job")
NAMES += ("unnamed", "missed")  # several names


def read_table(path):
    """Return a table written as TSV (.tsv) or CSV: NAMES as text, all else as numbers where it can be; empty is NaN."""
    separator = "\t" if Path(path).suffix == ".tsv" else ","
    with reading(path, "a table (TSV or CSV)"):
        columns = pd.read_csv(path, sep=separator, nrows=0).columns
        return pd.read_csv(
            path,
            sep=separator,
            dtype={column: str for column in columns if column in NAMES},
            keep_default_na=False,
            na_values={column: [""] for column in columns if column not in NAMES},
        )
