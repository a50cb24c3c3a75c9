"""The materials that the facets of a surface are made of: tables on the MERL grid."""

import functools
from pathlib import Path

import torch

from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles
from neumat.brdf.embedded import embedded_names, embedded_table
from neumat.brdf.table import Table
from neumat.errors import NeumatError
from neumat.export.materials import find_material
from neumat.export.reading import READERS, read_material
from neumat.fields.field import Field
from neumat.fields.layout import widths_of


def field_table(weights):
    """Return the Table of a field's weights (675,), or of another width."""
    entries = torch.nonzero(above_horizon())[:, 0]
    values = torch.full((ENTRIES, 3), torch.nan)
    field = Field(weights, widths_of(len(weights)))
    values[entries] = torch.cat([field.eval(*grid_angles(part)) for part in entries.split(1 << 16)])
    return Table(values)


@functools.lru_cache(maxsize=8)
def _embedded(name):
    return Table(embedded_table(embedded_names().index(name)))


def facet_material(name, store=None):
    """Return the Table of a material.

    name: of an embedded material; the path of a file that `export.read_material` reads; or, where the path of a store
    is given, of a field in it, see `export.find_material`. Raises NeumatError for a name that is none, and a bad file.
    """
    if store is not None:
        return field_table(find_material(store, name))
    if name in embedded_names():
        return _embedded(name)
    if not name.lower().endswith(tuple(READERS)) and not Path(name).exists():
        raise NeumatError("material", "the name of an embedded material, or a file", repr(name))
    material = read_material(name)
    return material if isinstance(material, Table) else field_table(material)
