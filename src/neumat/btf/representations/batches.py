"""What training sees of a store: encoded values, sweep by sweep, every texel once in each and in order."""

import torch

MEMORY = 1 << 30  # bytes of values held at a time
PAIRS = 1024  # of directions in a step on pictures, about


def rows_of_pairs(store):
    """Return (K, p): texel t of a sweep sees pair t mod p, so that texels are K rows of p.

    Of pictures, whole rows of texels up to PAIRS: texel t of a step sees the one of p pictures of number t mod p.
    """
    texels, pairs = store.height * store.width, store.pairs
    if store.kind == "pictures":
        lines = [n for n in range(1, store.height + 1) if store.height % n == 0 and n * store.width <= PAIRS]
        pairs = store.width * max(lines, default=1)
    return texels // pairs, pairs


def batches(store, encode, generator):
    """Yield, for ever, (light (p, 3), view (p, 3), target (3, K, p)) of single sweeps in random order.

    encode: from values to targets, both float32. A store larger than MEMORY is loaded in parts, in random order.
    """
    held = max(1, MEMORY // (6 * store.height * store.width))
    if store.sweeps <= held:
        part = torch.arange(store.sweeps)
        loaded = _load(store, part, encode)
        while True:
            yield from _steps(store, part, loaded, generator)
    while True:
        for part in torch.randperm(store.sweeps, generator=generator).split(held):
            yield from _steps(store, part, _load(store, part, encode), generator)


def _load(store, part, encode):
    """Return the encoded values (m, 3, K, p), or of pictures (m, 3, H W), float16, of sweeps (m,)."""
    loaded = torch.empty(len(part), 3, store.height * store.width, dtype=torch.float16)
    for k, index in enumerate(part):
        loaded[k] = encode(store.values(index[None]).float()).view(-1, 3).T
    return loaded


def _steps(store, part, loaded, generator):
    """Yield as many batches as there are sweeps in `part` (m,), whose values are `loaded`."""
    rows, pairs = rows_of_pairs(store)
    light, view = store.light[part], store.view[part]
    if store.kind == "queries":
        for k in torch.randperm(len(part), generator=generator):
            yield light[k], view[k], loaded[k].view(3, rows, pairs).float()
        return
    texel = torch.arange(rows * pairs).view(rows, pairs)
    for _ in part:
        chosen = torch.randint(len(part), (pairs,), generator=generator)
        place = texel + chosen * (3 * rows * pairs)
        target = torch.stack([loaded.flatten().take(place + channel * rows * pairs) for channel in range(3)])
        yield light[chosen, 0], view[chosen, 0], target.float()
