"""What a query of a model costs in Mitsuba."""

import numpy as np
import torch

from neumat.render.mitsuba_scene import mitsuba
from neumat.render.variant import clock
from neumat.seeds import torch_generator

QUERIES = {"scalar": 500, "jit": 1 << 19}
REPEATS = 5


def nanoseconds(plugin):
    """Return the time (see `clock`) of one evaluation of a BSDF, a Mitsuba dictionary, in ns: the least of REPEATS.

    In compiled variants of Mitsuba as part of half a million, once compiled; in scalar ones, of one at a time.
    """
    mi = mitsuba()
    import drjit as dr

    from neumat.render.mitsuba_bsdf import load_dict

    bsdf, context, jit = load_dict(plugin), mi.BSDFContext(), dr.is_jit_v(mi.Float)
    count = QUERIES["jit" if jit else "scalar"]
    pairs = torch.randn(2, count, 3, generator=torch_generator(0, "queries"))
    pairs[..., 2].abs_()
    wi, wo = (part.T.numpy() for part in torch.nn.functional.normalize(pairs, dim=2))
    if jit:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi, direction = mi.Vector3f(wi), mi.Vector3f(wo)
        dr.eval(si, direction)
    seconds = []
    for _ in range(REPEATS + 1):  # the first one compiles
        start = clock()
        if jit:
            dr.eval(bsdf.eval(context, si, direction))
            dr.sync_thread()
        else:
            si = dr.zeros(mi.SurfaceInteraction3f)
            for one, other in zip(wi.T, wo.T, strict=True):
                si.wi = mi.Vector3f(one)
                bsdf.eval(context, si, mi.Vector3f(other))
        seconds.append(clock() - start)
    return float(np.min(seconds[1:])) / count * 1e9
