"""The sphere renderer beside Mitsuba: the same field, the same scene, two programs."""

import pandas as pd
import torch

from neumat.render.mitsuba_scene import render_mitsuba
from neumat.render.scene import to_srgb8
from neumat.render.sphere import radiance_fields


def verify(frozen, weights, spp=512):
    """Return a DataFrame with name, psnr, brightness for fields {name: weights (675,)}.

    psnr: dB between the 8-bit sRGB pictures, Mitsuba's noise at `spp` samples a pixel included; brightness: mean
    linear radiance on the sphere, as a multiple of Mitsuba's.
    """
    rows = []
    for name, vector in weights.items():
        ours = radiance_fields(frozen, vector[None])[0]
        theirs = torch.from_numpy(render_mitsuba(vector, frozen.size, spp))
        error = (to_srgb8(ours).double() - to_srgb8(theirs).double()).square().mean()
        on_sphere = frozen.coverage.view(frozen.size, frozen.size) == 1
        psnr = float(10 * torch.log10(255**2 / error))
        rows.append((name, psnr, float(ours[on_sphere].mean() / theirs[on_sphere].mean())))
    return pd.DataFrame(rows, columns=["name", "psnr", "brightness"])
