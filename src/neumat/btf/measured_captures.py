"""Captures of a measured BTF: its pictures, or random values of them, where a surface of a process is traced anew.

Pairs of directions are those of the file. A capture "grid" has all pairs of some views and lights, those nearest to the
configured rings. "held-out" has pairs outside the grid, and "queries" all but the held-out ones.
"""

import torch

from neumat.btf.directions import rings
from neumat.btf.pairs import given_pairs
from neumat.btf.representations.grid import regular_grid
from neumat.btf.store import write_btf
from neumat.errors import NeumatError
from neumat.seeds import torch_generator


def split_pictures(store, settings, seed):
    """Return {capture: the numbers (n,) of its pictures in the BtfStore `store`}, which has every light for each view.

    settings: grid {theta, count}, held_out {validation, report}, and shown, rows of four angles, degrees. The held-out
    pictures are those for validation, those for the report, both drawn at random, and those nearest to the shown pairs.
    Raises NeumatError where that would be more than half of the pictures, or than there are outside the grid.
    """
    views, lights, number = regular_grid(store, "measured BTF")
    wanted = rings(settings["grid"]["theta"], settings["grid"]["count"])
    near_views, near_lights = ((wanted @ each.T).argmax(1).unique() for each in (views, lights))
    grid = number[near_views][:, near_lights].flatten()
    free = torch.ones(store.sweeps, dtype=torch.bool)
    free[grid] = False
    room = min(int(free.sum()), store.sweeps // 2)
    shown, counts = given_pairs(settings["shown"]), settings["held_out"]
    drawn = counts["validation"] + counts["report"]
    if drawn + len(shown[0]) > room:
        expected = f"at most {room} pairs of btf.held_out and btf.pairs, of {store.sweeps} pictures"
        raise NeumatError("measured BTF", expected, f"{drawn} and {len(shown[0])}")
    nearest = []
    for light, view in zip(*shown, strict=True):
        likeness = store.light[:, 0] @ light + store.view[:, 0] @ view
        nearest.append(torch.where(free, likeness, -torch.inf).argmax())
        free[nearest[-1]] = False
    others = torch.nonzero(free)[:, 0]
    others = others[torch.randperm(len(others), generator=torch_generator(seed, "held-out pictures"))[:drawn]]
    held_out = torch.cat([others, torch.stack(nearest)])
    queries = torch.ones(store.sweeps, dtype=torch.bool)
    queries[held_out] = False
    return {"grid": grid, "held-out": held_out, "queries": torch.nonzero(queries)[:, 0]}


def write_measured_capture(store, capture, settings, surface, seed, path, progress=iter):
    """Write a capture, "grid", "held-out" or "queries", of the measured BTF in a BtfStore into the store `path`.

    settings: as in `split_pictures`, with queries {sweeps, pairs} and texels, along a side, to which pictures are
    averaged (None: their own). surface: the surface's config. Of more pictures than `sweeps`, each texel gets as many
    at random, without repetition, `pairs` in a sweep, or the largest number below that divides the texels; of fewer,
    all pictures are stored. Raises NeumatError for more texels than there are.
    """
    texels = settings["texels"] or store.height
    if texels > store.height:
        raise NeumatError("measured BTF", f"at most its own {store.height} texels along a side", texels)
    chosen = split_pictures(store, settings, seed)[capture]
    about = {"size_mm": store.size_mm, "partial": store.partial, "source": store.source, "surface": surface}
    sweeps = settings["queries"]["sweeps"]
    if capture != "queries" or len(chosen) <= sweeps:
        blocks = (_reduced(store, k, texels) for k in progress(chosen.tolist()))
        write_btf(path, store.light[chosen], store.view[chosen], texels, texels, blocks, kind="pictures", **about)
        return
    pairs = max(n for n in range(1, settings["queries"]["pairs"] + 1) if texels**2 % n == 0)
    generator = torch_generator(seed, "measured queries")
    order = torch.rand(len(chosen), pairs, generator=generator).argsort(0)[:sweeps]  # (s, p), of `chosen`
    values = torch.empty(sweeps, texels**2 // pairs, pairs, 3, dtype=torch.float16)
    for k, picture in enumerate(progress(chosen.tolist())):
        sweep, pair = torch.nonzero(order == k, as_tuple=True)
        values[sweep, :, pair] = _reduced(store, picture, texels).view(-1, pairs, 3)[:, pair].transpose(0, 1)
    number = chosen[order]
    blocks = values.view(sweeps, texels, texels, 3)
    write_btf(path, store.light[number, 0], store.view[number, 0], texels, texels, blocks, kind="queries", **about)


def _reduced(store, number, texels):
    """Return a picture (texels, texels, 3), float16, of a store: means over its texels."""
    picture = store.values([number])[0]
    if texels == store.height:
        return picture
    return torch.nn.functional.adaptive_avg_pool2d(picture.float().permute(2, 0, 1), texels).permute(1, 2, 0).half()
