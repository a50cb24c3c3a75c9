"""Real measurements as requests: pictures of RGL materials that no model here has seen."""

from pathlib import Path

import torch

from neumat.brdf.rgl import read_rgl
from neumat.brdf.table import valid_entries
from neumat.render.tables import radiance_tables, table_matrix


def measured_pictures(files, *spheres):
    """Return the names of isotropic RGL .bsdf files, and for each FrozenSphere their linear pictures
    (m, size, size, 3).
    """
    pictures = [[] for _ in spheres]
    for path in files:
        table = torch.from_numpy(read_rgl(path))
        entries = valid_entries(table).nonzero()[:, 0]
        for sphere, found in zip(spheres, pictures, strict=True):
            matrix, used = table_matrix(sphere, entries)
            found.append(radiance_tables(sphere, matrix, table[entries[used]]))
    return [Path(path).stem for path in files], *map(torch.cat, pictures)
