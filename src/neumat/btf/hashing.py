"""Random numbers that depend on the coordinates of a cell and a seed only.

32-bit integer arithmetic throughout, so that every device, and a shader, gives the same bits; a hash of sines would
depend on the precision of floats.
"""

MASK = 0xFFFFFFFF


def hashed_integers(cells, seed, channel=0):
    """Return integers (...), int64, 0 to 2^32 - 1, for the cells (..., k), int64; coordinates count modulo 2^32.

    `channel` numbers independent values of one cell; `seed` is any Python integer.
    """
    start = state = key(seed, channel)
    for coordinate in cells.unbind(-1):
        state = mix((state + coordinate) & MASK) ^ start
    return state


def key(seed, channel=0):
    """Return the integer that all hashes of a seed and a channel begin with."""
    return mix(mix(mix(seed & MASK) + (seed >> 32) & MASK) + channel & MASK)


def hashed(cells, seed, channel=0):
    """Return the integers of `hashed_integers` as float64 (...), uniform in [0, 1)."""
    return hashed_integers(cells, seed, channel).double() / 2.0**32


def mix(x):
    """Return `x`, integers of 32 bits of any library, mixed: each bit depends on all (Wellons's lowbias32).

    A product of two 32-bit numbers may overflow 64 bits; its low 32 bits are right all the same.
    """
    x = (x ^ (x >> 16)) * 0x7FEB352D & MASK
    x = (x ^ (x >> 15)) * 0x846CA68B & MASK
    return x ^ (x >> 16)
