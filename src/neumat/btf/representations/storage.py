"""Planes as they are stored: 32 or 16 bits a number, or 8 between the least and the largest of a channel."""

import torch

from neumat.errors import NeumatError

FLOATS = {32: torch.float32, 16: torch.float16}


def packed(name, plane, bits):
    """Return {name: tensor}, what is stored of a plane (..., c) under `name`; raises NeumatError for other bits."""
    if bits in FLOATS:
        return {name: plane.to(FLOATS[bits])}
    if bits != 8:
        raise NeumatError("bits", "32, 16 or 8", bits)
    rows = plane.flatten(0, -2)
    low, high = rows.amin(0), rows.amax(0)
    step = ((high - low) / 255).clamp_min(1e-12)
    levels = ((plane - low) / step).round_().to(torch.uint8)
    return {name: levels, f"{name}_range": torch.stack([low, step])}


def unpacked(name, state):
    """Return the plane (..., c), float32, that `packed` stored in `state`."""
    plane = state[name].float()
    if f"{name}_range" in state:
        low, step = state[f"{name}_range"]
        plane = plane * step + low
    return plane
