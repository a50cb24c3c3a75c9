"""The sphere renderer for the metric images: one fixed linear operator from BRDF values to a picture.

Seen by an orthographic camera, all points of the sphere with the same angle theta_o between normal and view form a
ring, and along it an isotropic BRDF is the same function of the light's direction: only the environment turns. So a
material is evaluated once per ring, at quadrature nodes that the whole ring shares, and a matrix per ring holds what
each node contributes at each azimuth. That gives every pixel a thousand light samples, without noise, at the price
of two evaluations of the material per pixel.
"""

import math
import warnings

import torch
from scipy import sparse

from neumat.brdf.coordinates import half_difference, rusinkiewicz
from neumat.fields.field import reflectance, with_biases
from neumat.render import scene
from neumat.render.quadrature import STRATEGIES, hemisphere

MATERIALS_AT_ONCE = 16  # on one ring their hidden layers stay in the cache
ROWS_AT_ONCE = 16  # of that many pictures


class FrozenSphere:
    """The scene of `scene.py` as a linear operator, made once and applied to any number of materials.

    Attributes: `theta_h`, `theta_d`, `phi_d` (queries,) are the directions at which a material is evaluated, ring by
    ring, and `inputs` (6, queries) the same as half and difference vectors; `transfer` (rings, azimuths, nodes) takes
    a ring's values to its radiance at each azimuth; `resampling` (size^2, rings * azimuths), sparse, takes these to
    pixels; `coverage` (size^2, 1) is the share of each pixel that the sphere fills. Nothing here is random.

    A pixel is the mean of subpixels^2 look-ups; at 256 pixels eight take 1.4 seconds to make, and two .1.
    """

    def __init__(
        self, size=256, rings=96, azimuths=128, strategies=STRATEGIES, environment=scene.environment, subpixels=8
    ):
        self.size = size
        theta_o = (torch.arange(rings, dtype=torch.float64) + 0.5) / rings * (math.pi / 2)
        light, view, weight = hemisphere(theta_o, strategies)
        angles = rusinkiewicz(light, view[:, None])
        # Nodes below the horizon weigh 0; their angles only have to be harmless.
        self.theta_h, self.theta_d, self.phi_d = (
            torch.where(weight > 0, angle, 0.0).flatten().float() for angle in angles
        )
        self.inputs = half_difference(self.theta_h, self.theta_d, self.phi_d).T.contiguous()
        lit = [environment(_world(*ring, azimuths)) for ring in zip(light, theta_o, strict=True)]
        self.transfer = torch.stack(lit) * weight[:, None].float()
        self.resampling, self.coverage = _resampling(size, rings, azimuths, subpixels)

    def pictures(self, values):
        """Return linear pictures (n, size, size, 3) of BRDF values (n, 3, queries), 1/sr, at this sphere's queries."""
        return self.from_rings(values.split(self.transfer.shape[2], 2))

    def from_rings(self, values):
        """Return linear pictures (n, size, size, 3) of an iterable of BRDF values (n, 3, nodes), 1/sr, ring by ring."""
        polar = [transfer @ ring.flatten(0, 1).T for transfer, ring in zip(self.transfer, values, strict=True)]
        flat = self.resampling @ torch.cat(polar) + scene.BACKGROUND * (1 - self.coverage)
        return flat.view(self.size, self.size, -1, 3).permute(2, 0, 1, 3)


def _world(light, theta_o, azimuths):
    """Return float32 world directions (azimuths, nodes, 3) of `light` (nodes, 3) for a ring's points in turn."""
    x, y, z = light.unbind(-1)
    sin_o, cos_o = theta_o.sin(), theta_o.cos()
    # The view goes to (0, 0, 1), the normal at azimuth 0 to (sin_o, 0, cos_o).
    x, y, z = sin_o * z - cos_o * x, -y, cos_o * z + sin_o * x
    turn = torch.arange(azimuths, dtype=torch.float64)[:, None] * (2 * math.pi / azimuths)
    x, y = x * turn.cos() - y * turn.sin(), x * turn.sin() + y * turn.cos()
    return torch.stack([x, y, z.expand_as(x)], -1).float()


def _resampling(size, rings, azimuths, subpixels):
    """Return the CSR matrix (size^2, rings * azimuths) from ring radiances to pixels, and the coverage (size^2, 1).

    A pixel is the mean of subpixels^2 bilinear look-ups; those beside the sphere leave room for the background.
    """
    grid = ((torch.arange(size * subpixels, dtype=torch.float64) + 0.5) / (size * subpixels) * 2 - 1) / scene.RADIUS
    cell = torch.arange(size * subpixels) // subpixels
    y, x = torch.meshgrid(-grid, grid, indexing="ij")
    inside = torch.hypot(x, y) < 1
    x, y, pixel = x[inside], y[inside], (cell[:, None] * size + cell)[inside]
    ring = (torch.hypot(x, y).asin() / (math.pi / 2) * rings - 0.5).clamp(0, rings - 1)
    azimuth = torch.atan2(y, x) / (2 * math.pi) * azimuths % azimuths
    low_r, low_a = ring.floor().clamp_max(rings - 2), azimuth.floor()
    high_r, high_a = ring - low_r, azimuth - low_a
    columns, shares = [], []
    for r, share_r in ((low_r, 1 - high_r), (low_r + 1, high_r)):
        for a, share_a in ((low_a, 1 - high_a), ((low_a + 1) % azimuths, high_a)):
            columns.append((r * azimuths + a).long())
            shares.append(share_r * share_a / subpixels**2)
    coverage = torch.zeros(size**2, 1).index_add_(0, pixel, torch.full((len(pixel), 1), 1 / subpixels**2))
    return csr(pixel.repeat(4), torch.cat(columns), torch.cat(shares), (size**2, rings * azimuths)), coverage


def csr(rows, columns, values, shape):
    """Return a float32 CSR tensor of `shape`; entries given twice are added."""
    # scipy sorts by counting, several times as fast as torch's coalesce.
    summed = sparse.coo_array((values.numpy(), (rows.numpy(), columns.numpy())), shape).tocsr()
    parts = (torch.from_numpy(part) for part in (summed.indptr, summed.indices, summed.data))
    with warnings.catch_warnings(), torch.sparse.check_sparse_tensor_invariants(True):
        warnings.filterwarnings("ignore", "Sparse CSR tensor support is in beta")
        return torch.sparse_csr_tensor(*parts, shape).float()


@torch.inference_mode()
def radiance_fields(frozen, weights):
    """Return linear float32 pictures (n, size, size, 3) of neural fields (n, 675)."""
    return torch.cat([_block(frozen, block) for block in weights.split(MATERIALS_AT_ONCE)])


@torch.inference_mode()
def render_fields(frozen, weights):
    """Return 8-bit sRGB pictures (n, size, size, 3) of neural fields (n, 675)."""
    return torch.cat([quantised(_block(frozen, block)) for block in weights.split(MATERIALS_AT_ONCE)])


def quantised(pictures):
    """Return `scene.to_srgb8` of linear pictures (n, size, size, 3), by rows, which fit the cache."""
    return torch.cat([scene.to_srgb8(rows) for rows in pictures.split(ROWS_AT_ONCE, 1)], 1)


def _block(frozen, weights):
    """Return linear pictures of a block of fields."""
    layers = with_biases(weights)
    inputs = torch.cat([frozen.inputs, torch.ones_like(frozen.inputs[:1])])
    return frozen.from_rings(reflectance(layers, ring) for ring in inputs.split(frozen.transfer.shape[2], 1))
