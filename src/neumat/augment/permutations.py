"""The six orders of the colour channels."""

from neumat.errors import NeumatError

PERMUTATIONS = ("rgb", "rbg", "grb", "gbr", "brg", "bgr")


def channel_order(permutation):
    """Return the channels that R, G and B are taken from: "gbr" gives [1, 2, 0]."""
    if permutation not in PERMUTATIONS:
        raise NeumatError("permutation", f"one of {', '.join(PERMUTATIONS)}", repr(permutation))
    return ["rgb".index(channel) for channel in permutation]
