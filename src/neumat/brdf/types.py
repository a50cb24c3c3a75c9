"""The types of materials: which of M3ashy's 48 (its appendix D.3) each measured material is, and what it is made of."""

import numpy as np
import pandas as pd

from neumat.errors import NeumatError
from neumat.files import reading

COLUMNS = ["name", "type", "family", "description"]


def read_types(path):
    """Return the assignment written as TSV, a DataFrame indexed by the name of the measured material.

    Columns: type; family ("metal", "wood", ...), the word for what the type is made of; description, what one calls
    the material, colour words left out. Raises NeumatError for a missing file, missing columns or a name given twice.
    """
    with reading(path, "a table of material types (TSV)"):
        table = pd.read_csv(path, sep="\t", dtype=str, keep_default_na=False)
    if list(table.columns) != COLUMNS:
        raise NeumatError(path, f"columns {', '.join(COLUMNS)}", ", ".join(table.columns))
    twice = table["name"][table["name"].duplicated()]
    if len(twice):
        raise NeumatError(path, "each material once", f"{twice.iloc[0]} twice")
    return table.set_index("name")


def type_names(manifest, types):
    """Return the names of the types of `read_types` that the manifest's sources have, sorted: their order in every
    one-hot row. None where the table names none of the sources."""
    sources = set(manifest["parent_a"]) | set(manifest["parent_b"])
    return sorted(set(types["type"][types.index.isin(sources)]))


def type_rows(manifest, types):
    """Return float32 (n, T): row i holds 1 / m at each of the m types of the manifest's material i.

    A blend carries the types of both parents, a permuted material those of its base. A material that the table does
    not name has a row of zeros.
    """
    number = {name: k for k, name in enumerate(type_names(manifest, types))}
    rows = np.zeros((len(manifest), len(number)), np.float32)
    for parent in ("parent_a", "parent_b"):
        found = manifest[parent].map(types["type"]).map(number)
        known = found.notna().to_numpy()
        rows[np.flatnonzero(known), found[known].astype(int)] = 1
    return rows / np.maximum(rows.sum(1, keepdims=True), 1)
