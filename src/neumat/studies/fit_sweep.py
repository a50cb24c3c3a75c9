"""Chart 1: what a fit costs and what it reaches, over budget, schedule, precision, batch, width and sampling."""

import time

import numpy as np
import pandas as pd
import torch
from torch import nn

from neumat.augment.permutations import PERMUTATIONS
from neumat.augment.store import AugMerl
from neumat.fields.field import evaluate_inputs
from neumat.fields.fit import Directions, first_field, fit
from neumat.fields.layout import WIDTHS
from neumat.fields.stages import load_values
from neumat.generative.training import seeded
from neumat.metrics.pictures import compare_pictures
from neumat.render.scene import to_srgb8
from neumat.seeds import torch_generator
from neumat.studies.fit_quality import Pictures
from neumat.studies.measured_fits import NONE, REPORTING, VALIDATION, MeasuredMaterials

PAPER = {"schedule": "constant", "learning_rate": 5e-3, "batch_size": 512}
PAPER |= {"highlight_share": 1.0, "precision": "float32", "polish": {"samples": 0}}
SHARES = (0.25, 0.5, 2, 4)  # of the default's samples, of both optimisers
SWEEP = {
    "schedule": ("constant",),
    "precision": ("float32", "bfloat16"),
    "batch_size": (256, 512),
    "highlight_share": (0.0, 0.25, 0.5, 0.75, 1.0),
}
ADAM, SOAP = (2, 4), (1, 2)  # shares of the default's samples that go to one optimiser alone
SOAP_RATE = 1e-2  # the best for SOAP alone
WIDE = (4, 8, 12, 32)


def variants(default, published):
    """Return [(family, label, config, width)]: the default, one change at a time, each optimiser alone, and M3ashy's
    schedule with as many samples as its released code visits, `published["m3ashy"]`."""
    found = [("default", f"{_millions(default)}, {default['schedule']}", default, 21)]
    for share in SHARES:
        config = _shared(default, share)
        found.append(("samples", f"{_millions(config)} samples", config, 21))
    for key, values in SWEEP.items():
        for value in values:
            if value != default[key]:
                found.append((key, f"{key.replace('_', ' ')} {value}", default | {key: value}, 21))
    alone = {"samples": 0}
    for share in ADAM:
        config = default | {"samples": int(share * default["samples"]), "polish": alone}
        found.append(("optimiser", f"Adam alone, {_millions(config)}", config, 21))
    for share in SOAP:
        polish = {"samples": int(share * default["samples"]), "learning_rate": SOAP_RATE}
        config = default | alone | {"polish": default["polish"] | polish}
        found.append(("optimiser", f"SOAP alone, {_millions(config)}", config, 21))
    found += [("width", f"width {width}", default, width) for width in WIDE]
    return [*found, ("paper", "M3ashy's schedule", default | PAPER | {"samples": published["m3ashy"]}, 21)]


def _shared(default, share):
    polish = default["polish"] | {"samples": int(share * default["polish"]["samples"])}
    return default | {"samples": int(share * default["samples"]), "polish": polish}


def _millions(config):
    return f"{_samples(config) / 1e6:.3g} M"


def _samples(config):
    """Return the training samples of a material, of both optimisers."""
    return config["samples"] + config["polish"]["samples"]


def published_rate(values, directions, seconds=5.0):
    """Return the samples per second of the published way to fit: one material, nn.Linear, autograd, Adam, batch 512."""
    with seeded(0, "published loop"):
        network = nn.Sequential(nn.Linear(6, 21), nn.ReLU(), nn.Linear(21, 21), nn.ReLU(), nn.Linear(21, 3))
    generator = torch_generator(0, "published loop")
    optimiser = torch.optim.Adam(network.parameters(), lr=5e-3)
    start, done = time.process_time(), 0
    while time.process_time() - start < seconds:
        batch = directions.train[torch.randint(len(directions.train), (512,), generator=generator)]
        cosine = directions.cosine[batch]
        found = torch.log1p(torch.expm1(network(directions.inputs[batch])).clamp_min(0) * cosine)
        loss = (found - torch.log1p(values[batch].float() * cosine)).abs().mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        done += 512
    return done / (time.process_time() - start)


def cost(samples, seconds, first_seconds, served, rate, published):
    """Return what a fit costs beside the published loop: a dict of a row's columns.

    samples, seconds: of one material's fit; first_seconds: of the first field, which `served` materials start from;
    rate: samples per second of the published loop; published: {program: samples that it visits for a material}.

    first_seconds: one material's share of the first field; seconds: of CPU time of a material, that share included;
    rate_ratio: samples per second of the fit over the published loop's; speedup_*: seconds that the published loop
    takes for a program's samples, over `seconds`.
    """
    share = first_seconds / served
    total = seconds + share
    row = {"samples": samples, "seconds": total, "first_seconds": share, "rate_ratio": samples / seconds / rate}
    return row | {f"speedup_{program}": count / rate / total for program, count in published.items()}


def sweep(augmerl_path, sources_path, default, published, materials, files, size, seed, progress=iter):
    """Return a DataFrame: family, label, the columns of `cost`, loss_grid, loss_uniform, psnr, psnr_worst, ssim.

    default: the section `fit`; published: {"m3ashy": samples that its released code visits for a material, ...};
    materials: how many base materials, evenly spread over all. Seconds are CPU seconds in this run, which a busy
    machine distorts least; the published loop is measured beside them. The first field's are shared by all base
    materials of the store, which start from it. Last come measured materials, files as in `MeasuredMaterials`: those
    for validation with every budget, by which one is chosen, and those that report with the default. They cost what
    the same setting cost before.
    """
    store = AugMerl(augmerl_path, sources_path)
    directions = Directions(store.entries, seed)
    bases = np.unique(np.linspace(0, store.n - 1, materials).round().astype(int)) * len(PERMUTATIONS)
    values = load_values(store, bases)
    pictures = Pictures(store, size)
    expected = pictures.tables(bases)
    inputs = pictures.frozen.inputs.T.contiguous()
    rate = published_rate(values[:, 0], directions)
    rows, firsts = [], {}
    for family, label, config, width in progress(variants(default, published)):
        widths = (WIDTHS[0], width, width, WIDTHS[-1])
        if width not in firsts:
            start = time.process_time()
            first = first_field(values[:, :1], directions, default, seed, widths)
            firsts[width] = first, time.process_time() - start
        first, first_seconds = firsts[width]
        start = time.process_time()
        result = fit(values, directions, first, config, seed, widths)
        seconds = (time.process_time() - start) / len(bases)
        fields = evaluate_inputs(result["weights"], inputs, widths).transpose(1, 2)
        psnr, ssim = compare_pictures(expected, to_srgb8(pictures.frozen.pictures(fields)))
        row = {"family": family, "label": label}
        row |= cost(_samples(config), seconds, first_seconds, store.n, rate, published)
        row |= {key: result[key].mean().item() for key in ("loss_grid", "loss_uniform")}
        rows.append(row | {"psnr": psnr.mean(), "psnr_worst": psnr.min(), "ssim": ssim.mean()})
    return pd.DataFrame([*rows, *measured_rows(rows, files, firsts[WIDTHS[1]][0], default, size, seed)])


def measured_rows(rows, files, first, default, size, seed):
    """Return the rows of measured materials, whose `family` is their set, beside `rows` of the same settings."""
    if not files:
        return [{"family": NONE, "label": NONE}]
    materials, found = MeasuredMaterials(files, size, seed), []
    settings = {row["label"]: row for row in rows}
    for family, label, config, _ in variants(default, {"m3ashy": 0}):
        if family in ("default", "samples"):
            chosen = (VALIDATION, REPORTING) if family == "default" else (VALIDATION,)
            for which, part in materials.fit(chosen, first, config, seed).groupby("set", sort=False):
                means = part[["loss_grid", "loss_uniform", "psnr", "ssim", "loss_published"]].mean().to_dict()
                row = {"family": which, "label": f"{label}: {which}", "psnr_worst": part["psnr"].min()}
                found.append(settings[label] | row | means)
    return found
