"""What a way of drawing directions costs and how much noise it leaves: Mitsuba's pictures, sampler by sampler."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from neumat.export import export
from neumat.fields.field import highlights
from neumat.render import scene
from neumat.render.lobes import SAMPLERS
from neumat.render.mitsuba_scene import bsdf, render_scene, sphere_scene
from neumat.render.variant import clock

SIZE = 32  # pixels
REFERENCE = 8  # times as many samples as the finest picture
RANKS = {"matte": 0.12, "satin": 0.5, "glossy": 0.8, "mirror": 1.0}  # by height of the highlight
MEASURED = "measured"  # Mitsuba's own BSDF, on the exported file


def by_kind(weights):
    """Return {kind: position} of one field (n, 675) of each kind in RANKS."""
    order = highlights(weights).argsort()
    return {kind: int(order[round(rank * (len(order) - 1))]) for kind, rank in RANKS.items()}


def noise_sweep(materials, samples, progress=iter):
    """Return a DataFrame of pictures: kind, material, sampler, spp, seconds, rmse, psnr.

    materials: {kind: (name, weights (675,))}; samples: samples a pixel, ascending. seconds: the time of a picture by
    `clock`, once the scene is loaded and its kernel compiled. rmse: of the linear pictures of two seeds, exposed and
    clipped to 0..1 as they are shown, against one with REFERENCE times the most samples; that of "measured" holds the
    error of its table too. psnr: the same in dB.
    """
    rows = []
    with TemporaryDirectory() as folder:
        for kind, (name, weights) in progress(materials.items()):
            exported = export(weights, "rgl", Path(folder), name)
            shown = _shown(render_scene(sphere_scene(bsdf(weights), SIZE), REFERENCE * samples[-1], seed=1))
            plugins = {sampler: bsdf(weights) | {"sampler": sampler} for sampler in SAMPLERS}
            plugins[MEASURED] = {"type": MEASURED, "filename": str(exported)}
            for sampler, plugin in plugins.items():
                loaded = sphere_scene(plugin, SIZE)
                for spp in samples:
                    # The first picture compiles the kernel, which depends on the number of samples.
                    pictures = [render_scene(loaded, spp)]
                    start = clock()
                    pictures.append(render_scene(loaded, spp, seed=2))
                    seconds = clock() - start
                    rmse = float(np.sqrt(np.mean([(_shown(picture) - shown) ** 2 for picture in pictures])))
                    rows.append((kind, name, sampler, spp, seconds, rmse, -20 * np.log10(max(rmse, 1e-6))))
    return pd.DataFrame(rows, columns=["kind", "material", "sampler", "spp", "seconds", "rmse", "psnr"])


def _shown(linear):
    """Return a linear picture as it is shown, before the sRGB curve, in double precision."""
    return np.clip(linear.astype(float) * scene.EXPOSURE, 0, 1)
