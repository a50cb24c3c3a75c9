"""Linear representations of pictures on a grid of views and lights: principal components, spherical harmonics."""

from dataclasses import dataclass, replace

import torch

from neumat.btf.exposure import exposure
from neumat.btf.representations.base import Representation
from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.grid import Triangles, regular_grid
from neumat.seeds import torch_generator

BLOCK = 16  # pictures at a time
QUERIES = 1 << 12  # values evaluated at a time


@dataclass(kw_only=True)
class Linear(Representation):
    """curve: of the `Encoding` in which the expansion is linear; 0, as published, takes the values themselves.

    Levels of detail are means of features: exact for a curve of 0. With 6 their colours are off by 3 to 9 % on captured
    surfaces, by 26 % at worst (spherical harmonics of metal over the whole exemplar). Expansions fitted to means of
    pictures are off by more: a fit loses highlights, which means keep.

    On captured surfaces 6 is far better than 0 where they are glossy (FLIP of PCA on metal .41 against .72), and a
    little worse where they are matte (weave .31 against .27).
    """

    curve: float = 6.0

    def positional(self):
        """Return the plane (H, W, c) float32."""
        return self.state["positional"].float()

    def _eval(self, features, light, view):
        encoding = Encoding(*self.state["encoding"].tolist())
        meshes = [Triangles(self.state[name]) for name in ("views", "lights")]
        found = torch.empty(len(features), 3)
        for start in range(0, len(features), QUERIES):
            part = slice(start, start + QUERIES)
            pair = [each if len(each) == 1 else each[part] for each in (view, light)]
            found[part] = self._expand(features[part], *pair, *meshes)
        return encoding.decode(found)


@dataclass(kw_only=True)
class Pca(Linear):
    """The leading principal components of each channel's matrix, pictures x texels (as Koudelka et al. 2003).

    Components of texels are the plane; the coefficients of the pairs of directions are a table, interpolated between
    the three nearest lights of the three nearest views. The mean over the texels of a pair is kept beside them.
    components: of each channel; iterations: passes over the store.
    """

    components: int = 5
    iterations: int = 5

    def _fit(self, store, seed, progress):
        views, lights, sweeps = regular_grid(store, "pca")
        encoding = Encoding(exposure(store), self.curve)
        count, texels = min(self.components, sweeps.numel()), store.height * store.width
        basis = torch.randn(3, texels, min(2 * count, texels), generator=torch_generator(seed, "pca"))
        blocks = sweeps.flatten().split(BLOCK)
        for _ in progress(range(self.iterations)):
            total = torch.zeros_like(basis)
            for block in blocks:
                values = self._centred(store, block, encoding)[1]  # (3, k, H W)
                total += values.mT @ (values @ basis)
            basis = torch.linalg.svd(total, full_matrices=False).U
        basis = basis[..., :count] * texels**0.5
        table, brightest = torch.empty(sweeps.numel(), 3, count + 1), 0.0
        for k, block in enumerate(blocks):
            mean, values = self._centred(store, block, encoding)
            part = table[k * BLOCK : k * BLOCK + len(block)]
            brightest = max(brightest, (values.amax(2).T + mean).max().item())
            part[..., 0] = mean
            part[..., 1:] = (values @ basis).transpose(0, 1) / texels
        return {
            "positional": basis.permute(1, 0, 2).reshape(store.height, store.width, -1).half(),
            "table": table.view(len(views), len(lights), 3, -1).half(),
            "views": views,
            "lights": lights,
            "encoding": replace(encoding, ceiling=brightest).tensor(),
        }

    def _centred(self, store, indices, encoding):
        """Return (means (k, 3), values (3, k, H W) without them) of pictures (k,)."""
        values = encoding.checked(store.values(indices).float()).flatten(1, 2)
        mean = values.mean(1)
        return mean, (values - mean[:, None]).permute(2, 0, 1)

    def _expand(self, features, view, light, near_views, near_lights):
        (views, of_view), (lights, of_light) = near_views(view), near_lights(light)
        table = self.state["table"][views[:, :, None], lights[:, None]].float()  # (n, 3, 3, channel, 1 + components)
        mixed = (table * (of_view[:, :, None] * of_light[:, None])[..., None, None]).sum((1, 2))
        mean, coefficients = mixed[..., 0], mixed[..., 1:]
        return mean + (features.view(len(features), 3, -1) * coefficients).sum(-1)


@dataclass(kw_only=True)
class SphericalHarmonics(Linear):
    """Nine real spherical harmonics of the light for each channel, view and texel (as Kawasaki et al. 2005).

    The plane holds the 27 coefficients of each view of the grid; between views, those of the three nearest are
    interpolated. Least squares over the lights of a view. regularisation: what is added to the normal equations'
    diagonal, for each light.
    """

    regularisation: float = 1e-2

    def _fit(self, store, seed, progress):
        views, lights, sweeps = regular_grid(store, "sh")
        encoding = Encoding(exposure(store), self.curve)
        basis = harmonics(lights)
        normal = basis.T @ basis + self.regularisation * len(lights) * torch.eye(9)
        solve = torch.linalg.solve(normal, basis.T)  # (9, L)
        plane, brightest = torch.empty(store.height * store.width, len(views), 9, 3, dtype=torch.float16), 0.0
        for k in progress(range(len(views))):
            values = encoding.checked(store.values(sweeps[k]).float()).flatten(1)
            brightest = max(brightest, values.max().item())
            plane[:, k] = (solve @ values).view(9, -1, 3).transpose(0, 1)
        return {
            "positional": plane.view(store.height, store.width, -1),
            "views": views,
            "lights": lights,
            "encoding": replace(encoding, ceiling=brightest).tensor(),
        }

    def _expand(self, features, view, light, near_views, _):
        views, weight = near_views(view)
        near = features.view(len(features), -1, 9, 3).gather(
            1, views.expand(len(features), 3)[..., None, None].expand(-1, -1, 9, 3)
        )
        return (near * (weight[..., None] * harmonics(light)[:, None])[..., None]).sum((1, 2))


def harmonics(directions):
    """Return the real spherical harmonics (n, 9) of degrees 0 to 2 at unit vectors (n, 3).

    They are orthonormal over the sphere (Ramamoorthi and Hanrahan 2001, An efficient representation for irradiance
    environment maps, section 2).
    """
    x, y, z = directions.unbind(-1)
    first = 0.282095 * torch.ones_like(x), 0.488603 * y, 0.488603 * z, 0.488603 * x
    second = (
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3 * z * z - 1),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    )
    return torch.stack([*first, *second], -1)
