"""Tables of the workflow, written by pandas and read back letter for letter, and tables of config/, all text."""

import csv
from pathlib import Path

import pandas as pd

from neumat.errors import NeumatError
from neumat.files import cause, reading

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


def read_texts(path, what, columns):
    """Return a TSV file of `columns` (tuple), a DataFrame of str, letter for letter. Raises NeumatError for another
    file; what: it in words."""
    try:
        table = pd.read_csv(path, sep="\t", dtype=str, keep_default_na=False, quoting=csv.QUOTE_NONE)
    except OSError as error:
        raise NeumatError(path, f"{what} (TSV)", cause(path, error)) from error
    except (UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise NeumatError(path, f"{what} (TSV)", " ".join(str(error).split())) from error
    if tuple(table.columns) != columns:
        raise NeumatError(path, f"the columns {', '.join(columns)}", ", ".join(map(repr, table.columns)))
    return table
