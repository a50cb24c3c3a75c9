"""The ladder over all angles: what each model of a measured material costs, and what it reaches."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
import torch

from neumat.render.lobes import fit_lobes
from neumat.render.mitsuba_scene import render_bsdf
from neumat.render.scene import to_srgb8
from neumat.scenes.costs import nanoseconds
from neumat.scenes.fits import even_queries, fit_analytic, fit_fields, pools, query_error
from neumat.scenes.materials import stored_table
from neumat.scenes.models import ANALYTIC, ANALYTIC_SHARE, SMALLER, WIDEST, Model


def ladder_table(store, materials, first, steps, size, samples, seed, progress=iter):
    """Return a DataFrame with a row for each material and rung.

    store: an AugMerl; materials: {name: (its index, field (675,))}; first: (675,) weights that the widest field is
    fitted from, another material's: it would else be given what it is to find. size, samples: of the pictures that are
    compared, pixels and samples a pixel.

    material, rung, bytes, ns (of a query), fit_seconds; error: share of what is reflected under uniform angles (see
    `fits.query_error`); psnr: dB between the 8-bit pictures of Mitsuba's sphere with the model and with the table, both
    drawn by the table's lobes.
    """
    tables = {name: stored_table(store, index) for name, (index, _) in materials.items()}
    pool = pools({name: even_queries(table, seed) for name, table in tables.items()}, tables, seed)
    fields = torch.stack([field for _, field in materials.values()])
    found = {rung: fit_analytic(rung, pool, steps // ANALYTIC_SHARE, seed) for rung in progress(ANALYTIC)}
    found |= fit_fields(SMALLER, pool, fields, steps, seed, progress)
    found |= fit_fields([WIDEST], pool, first.expand_as(fields), steps, seed, progress)
    found["table"] = [_tabulated(store, index) for index, _ in materials.values()]
    rows = []
    with TemporaryDirectory() as folder:
        ns = {rung: nanoseconds(models[0].plugin(Path(folder))) for rung, models in found.items()}
        for k, name in enumerate(progress(materials)):
            lobes = fit_lobes(tables[name])
            truth = _picture(found["table"][k].plugin(Path(folder), lobes), size, samples)
            for rung, models in found.items():
                shown = _picture(models[k].plugin(Path(folder), lobes), size, samples)
                error = float((truth - shown).square().mean())
                psnr = float("inf") if error == 0 else float(10 * torch.log10(torch.tensor(255**2 / error)))
                value = models[k].material.eval(*(axis[k] for axis in pool.angles))
                share = float(query_error(value, pool.values[k], pool.floor[k]))
                cost = models[k].bytes, ns[rung], models[k].seconds
                rows.append((name, rung, *cost, share, psnr))
    return pd.DataFrame(rows, columns=["material", "rung", "bytes", "ns", "fit_seconds", "error", "psnr"])


def _tabulated(store, index):
    start = time.process_time()
    table = stored_table(store, index)
    return Model.of_table(table, time.process_time() - start)


def _picture(plugin, size, samples):
    return to_srgb8(torch.from_numpy(render_bsdf(plugin, size, samples))).double()
