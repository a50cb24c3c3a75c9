"""Random generators derived from the config's seed and the name of what they are for."""

import hashlib

import numpy as np


def seed_for(seed, *names):
    """Return a 63-bit integer that depends on `seed` and `names` only."""
    text = "/".join(str(part) for part in (seed, *names))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def numpy_generator(seed, *names):
    """Return a numpy Generator for one named purpose."""
    return np.random.default_rng(seed_for(seed, *names))


def torch_generator(seed, *names, device="cpu"):
    """Return a torch Generator for one named purpose."""
    import torch  # here, since a dry run draws the manifest and has no other use for it

    return torch.Generator(device=device).manual_seed(seed_for(seed, *names))
