"""Captured BTFs written as Bonn's `.btf` files (DFMF), which other programs read: see `neumat.btf.bonn`.

Each channel's matrix, pictures x texels, is factorised by a randomised singular value decomposition (Halko, Martinsson
and Tropp 2011, Finding structure with randomness, algorithms 4.4 and 5.1), which reads the store in blocks, 6 times.
"""

import struct

import torch

from neumat.btf.bonn_header import DFMF, META
from neumat.btf.colour_models import ENCODERS
from neumat.btf.picture_set import blocks
from neumat.errors import NeumatError
from neumat.files import atomic_path
from neumat.seeds import torch_generator

SCALARS = {2: torch.float16, 4: torch.float32}  # by their size in bytes
OVERSAMPLING, ITERATIONS = 10, 2


def write_dfmf(path, store, components=100, colour_model=11, scalar_size=2, seed=0, progress=iter):
    """Write a BtfStore of pictures to `path`, a DFMF file.

    components: of each channel, at most; colour_model: 11 (UBO2014's: logarithm of Y, and U and V relative to Y) or 0
    (RGB); scalar_size: bytes of a number, 2 or 4. progress wraps the range of the passes over the store. Raises
    NeumatError for other options, for random queries, and for pictures that are not each light for each view.
    """
    for name, value, known in (("colour_model", colour_model, ENCODERS), ("scalar_size", scalar_size, SCALARS)):
        if value not in known:
            raise NeumatError(path, f"{name}: one of {', '.join(map(str, known))}", value)
    if components < 1:
        raise NeumatError(path, "at least 1 component", components)
    order, lights, views = _grid(path, store)
    factors = _factorised(_Matrices(store, order, ENCODERS[colour_model]), components, seed, progress)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(_header(store, lights, views))
        kept = factors[0][1].shape[1]
        file.write(struct.pack("<Ii12f", kept, colour_model, *(0.0,) * 3, *torch.eye(3).flatten().tolist()))
        for values, directions, texels in factors:
            file.write(struct.pack("<B3I", scalar_size, kept, len(directions), len(texels)))
            for array in (values, directions, texels):
                scalars = array.to(SCALARS[scalar_size])
                if not scalars.isfinite().all():
                    raise NeumatError(path, "factors that half precision holds", "larger ones: take scalar_size 4")
                file.write(scalars.contiguous().numpy().astype(f"<f{scalar_size}").tobytes())


class _Matrices:
    """The channels of a store's pictures as three matrices (3, pictures, texels), in the order of the file: one block
    of rows is held at a time."""

    def __init__(self, store, order, encode):
        self.store, self.order, self.encode = store, order, encode
        self.rows, self.columns = len(order), store.height * store.width

    def blocks(self):
        """Yield (slice of rows, channels (3, rows, columns))."""
        for rows in blocks(self.rows, max(self.store.height, self.store.width)):
            pictures = self.store.values(self.order[rows]).float().flip(1)
            yield rows, self.encode(pictures).reshape(len(pictures), self.columns, 3).permute(2, 0, 1).contiguous()

    def times(self, right):
        """Return the products (3, rows, k) with right (3, columns, k)."""
        return torch.cat([block @ right for _, block in self.blocks()], 1)

    def transposed_times(self, left):
        """Return the products (3, columns, k) of the transposed matrices with left (3, rows, k)."""
        return sum(block.mT @ left[:, rows] for rows, block in self.blocks())


def _factorised(matrices, components, seed, progress):
    """Return, for each channel, singular values (k,), directions (rows, k), texels (columns, k) times the values."""
    kept = min(components, matrices.rows, matrices.columns)
    rank = min(kept + OVERSAMPLING, matrices.rows, matrices.columns)
    texels = torch.randn(3, matrices.columns, rank, generator=torch_generator(seed, "DFMF"))
    for _ in progress(range(ITERATIONS + 1)):
        basis = torch.linalg.qr(matrices.times(texels))[0]
        products = matrices.transposed_times(basis)
        texels = torch.linalg.qr(products)[0]
    left, values, right = torch.linalg.svd(products, full_matrices=False)
    directions = basis @ right.mT
    scaled = left * values[:, None]
    return [(s[:kept], d[:, :kept], t[:, :kept]) for s, d, t in zip(values, directions, scaled, strict=True)]


def _grid(path, store):
    """Return the sweeps in the order of the file (v l,), the lights (l, 3) and the views (v, 3)."""
    if store.kind != "pictures":
        raise NeumatError(path, "a store of pictures", f"one of {store.kind}")
    indices = []
    for directions in (store.light, store.view):
        _, index = torch.unique(directions[:, 0], dim=0, return_inverse=True)
        indices.append(_by_appearance(index))
    light, view = indices
    lights = int(light.max()) + 1
    cell = view * lights + light
    order = cell.argsort()
    if not torch.equal(cell[order], torch.arange((int(view.max()) + 1) * lights)):
        raise NeumatError(path, f"each of {lights} lights once for each of {int(view.max()) + 1} views", "another set")
    return order, store.light[order[:lights], 0], store.view[order[::lights], 0]


def _by_appearance(index):
    """Return indices (n,), renumbered by where each is first found."""
    count = int(index.max()) + 1
    first = torch.full((count,), len(index)).scatter_reduce(0, index, torch.arange(len(index)), "amin")
    return first.argsort().argsort()[index]


def _header(store, lights, views):
    """Return the bytes of the file up to its colour model."""
    density = store.width / (store.size_mm * store.extent)
    meta = struct.pack(META, 4, b"neumat", b"", b"", density, 1.0, 1.0, 1.0)
    meta += struct.pack("<3I", store.cosine, 0, 3) + b"".join(
        struct.pack("<I", 1) + name for name in (b"R", b"G", b"B")
    )
    sampling = struct.pack("<I", len(views))
    for view in views:
        sampling += _angles(view[None]) + struct.pack("<I", len(lights)) + _angles(lights)
    return DFMF + struct.pack("<I", len(meta) + 4) + meta + sampling + struct.pack("<3I", store.width, store.height, 0)


def _angles(directions):
    """Return theta and phi of directions (n, 3), packed."""
    x, y, z = directions.double().unbind(-1)
    angles = torch.stack([torch.atan2(torch.hypot(x, y), z), torch.atan2(y, x)], -1)
    return angles.numpy().astype("<f4").tobytes()
