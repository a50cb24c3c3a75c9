"""How bright the pictures of a surface are shown: one factor for all of them."""

import math

import torch

from neumat.errors import NeumatError

SWEEPS = 64  # that are looked at
TEXELS = 4096  # of each
SHARE, LEVEL = 0.95, 0.6  # of 20 values, 19 are darker than .6 of the display's white, which sRGB shows as .80


def exposure(store):
    """Return the factor, in sr, that values of the BtfStore `store` are multiplied by before they are shown as sRGB.

    The 95th percentile of the brightness (mean of the channels) becomes 0.6, linear. Highlights beyond 1 are clipped
    when shown. It depends on the pairs of directions in the store: take it once for a surface, from the store that
    representations are fitted to, and use it for all pictures of that surface. Raises NeumatError for a black
    store, and for NaN.
    """
    sweeps = torch.linspace(0, store.sweeps - 1, min(SWEEPS, store.sweeps)).round().long()
    stride = max(1, store.height * store.width // TEXELS)
    brightness = torch.cat([store.values(one[None]).float().mean(-1).flatten()[::stride] for one in sweeps])
    level = brightness.double().quantile(SHARE).item()
    if math.isnan(level):
        raise NeumatError("store", "finite values", "NaN or infinite ones")
    if not level > 0:
        raise NeumatError("store", "values of which a twentieth is above 0", f"a 95th percentile of {level:.3g}")
    return LEVEL / level
