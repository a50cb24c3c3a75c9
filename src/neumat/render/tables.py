"""Pictures of tabulated materials: a table on the MERL grid is read at the sphere's queries by one sparse matrix."""

import math

import torch

from neumat.brdf.coordinates import ENTRIES, GRID, canonical_phi_d
from neumat.errors import NeumatError
from neumat.render.sphere import csr, quantised

MATERIALS_AT_ONCE = 16


def table_matrix(frozen, entries):
    """Return the trilinear look-up of the sphere's queries: (matrix, used).

    `entries` (V,): flat indices of the grid entries that the tables hold, ascending. `used` (U,): positions in
    `entries` of those that a picture depends on. `matrix`: CSR (queries, U); BRDF values at the queries are
    matrix @ table[used]. Where some of the 8 neighbours are missing, the others share their weight; where all are
    missing the value is 0. Raises NeumatError where `entries` is not ascending within the grid.
    """
    entries = torch.as_tensor(entries).long()
    if len(entries) == 0 or entries[0] < 0 or entries[-1] >= ENTRIES or not (entries.diff() > 0).all():
        raise NeumatError("table entries", f"ascending flat indices from 0 to {ENTRIES - 1}", "others")
    columns, shares = _neighbours(frozen)
    position = torch.full((ENTRIES,), -1)
    position[entries] = torch.arange(len(entries))
    columns = position[columns]
    shares = torch.where(columns >= 0, shares, 0.0)
    shares = shares / shares.sum(1, keepdim=True).clamp_min(1e-12)
    rows = torch.arange(len(columns))[:, None].expand_as(columns)
    kept = shares > 0
    used, compact = columns[kept].unique(return_inverse=True)
    return csr(rows[kept], compact, shares[kept], (len(columns), len(used))), used


def _neighbours(frozen):
    """Return the flat indices (queries, 8) of the grid entries around each query, and their trilinear weights."""
    n_h, n_d, n_p = GRID
    # The theta_h axis is quadratic; phi_d wraps at pi by reciprocity; the other axes end at their last entry.
    h = (torch.sqrt(frozen.theta_h.double() / (math.pi / 2)) * n_h).clamp(0, n_h - 1)
    d = (frozen.theta_d.double() / (math.pi / 2) * n_d).clamp(0, n_d - 1)
    p = canonical_phi_d(frozen.phi_d.double()) / math.pi * n_p
    low_h, low_d, low_p = h.floor().clamp_max(n_h - 2), d.floor().clamp_max(n_d - 2), p.floor()
    columns, shares = [], []
    for i, share_h in ((low_h, 1 - (h - low_h)), (low_h + 1, h - low_h)):
        for j, share_d in ((low_d, 1 - (d - low_d)), (low_d + 1, d - low_d)):
            for k, share_p in ((low_p % n_p, 1 - (p - low_p)), ((low_p + 1) % n_p, p - low_p)):
                columns.append((k + n_p * (j + n_d * i)).long())
                shares.append(share_h * share_d * share_p)
    return torch.stack(columns, 1), torch.stack(shares, 1)


@torch.inference_mode()
def radiance_tables(frozen, matrix, tables):
    """Return linear float32 pictures (n, size, size, 3) of tables (U, 3n), 1/sr, read at the `used` entries.

    Columns 3i, 3i + 1, 3i + 2 are the colour channels of material i.
    """
    blocks = tables.split(3 * MATERIALS_AT_ONCE, dim=1)
    return torch.cat([frozen.pictures((matrix @ block).T.unflatten(0, (-1, 3))) for block in blocks])


@torch.inference_mode()
def render_tables(frozen, matrix, tables):
    """Return 8-bit sRGB pictures (n, size, size, 3) of tables (U, 3n), as `radiance_tables` reads them."""
    return quantised(radiance_tables(frozen, matrix, tables))


@torch.inference_mode()
def render_combinations(frozen, values, coefficients):
    """Return 8-bit sRGB pictures (n, size, size, 3) of linear combinations of source tables.

    values: (queries, 3N), matrix @ columns of the sources, made once; coefficients (n, 3, 3N). Negative values are
    clamped to 0, as no material has them.
    """
    rings = values.T.split(frozen.transfer.shape[2], 1)
    blocks = coefficients.split(MATERIALS_AT_ONCE)
    return torch.cat([quantised(frozen.from_rings((block @ ring).clamp_min_(0) for ring in rings)) for block in blocks])
