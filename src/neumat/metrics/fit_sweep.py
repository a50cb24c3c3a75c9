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
from neumat.metrics.fit_quality import Pictures, compare_pictures
from neumat.render.scene import to_srgb8
from neumat.seeds import torch_generator

PAPER = {"samples": 117_000_000, "schedule": "constant", "learning_rate": 5e-3, "batch_size": 512}
PAPER |= {"highlight_share": 1.0, "optimiser": "adam", "precision": "float32"}
ADAM = {"optimiser": "adam", "batch_size": 256, "learning_rate": 5e-3}  # the best found for Adam
SWEEP = {
    "samples": (0.125, 0.25, 0.5, 2),  # of the default
    "schedule": ("constant",),
    "precision": ("float32", "bfloat16"),
    "learning_rate": (5e-3, 2e-2),
    "batch_size": (256, 512, 2048),
    "highlight_share": (0.0, 0.25, 0.5, 0.75, 1.0),
    "width": (4, 8, 12, 32),
}


def variants(default):
    """Return [(family, label, config, width)]: the default, one change at a time, Adam at once and twice the default's
    samples, and the papers' schedule."""
    name = f"{default['samples'] / 1e6:.3g} M, {default['optimiser']}, {default['schedule']}"
    found = [("default", name, default, 21)]
    for key, values in SWEEP.items():
        for value in values:
            if key == "width":
                found.append((key, f"width {value}", default, value))
            elif key == "samples":
                samples = int(value * default["samples"])
                found.append((key, f"{samples / 1e6:.3g} M samples", default | {"samples": samples}, 21))
            elif value != default[key]:
                found.append((key, f"{key.replace('_', ' ')} {value}", default | {key: value}, 21))
    for samples in (default["samples"], 2 * default["samples"]):
        found.append(("optimiser", f"Adam, {samples / 1e6:.3g} M samples", default | ADAM | {"samples": samples}, 21))
    paper = default | PAPER
    paper["samples"] = PAPER["samples"] * default["samples"] // 4_500_000  # in step with a smaller default
    return [*found, ("paper", "paper's schedule", paper, 21)]


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


def sweep(augmerl_path, sources_path, default, materials, size, seed, progress=iter):
    """Return a DataFrame: family, label, seconds (per material), loss_grid, loss_uniform, psnr, psnr_worst, ssim.

    default: the section `fit`; materials: how many base materials, evenly spread over all. Seconds are CPU seconds of
    one thread in this run, which a busy machine distorts least; `speedup` is against the published loop at the papers'
    sample count, measured beside it.
    """
    store = AugMerl(augmerl_path, sources_path)
    directions = Directions(store.entries, seed)
    bases = np.unique(np.linspace(0, store.n - 1, materials).round().astype(int)) * len(PERMUTATIONS)
    values = load_values(store, bases)
    pictures = Pictures(store, size)
    expected = pictures.tables(bases)
    inputs = pictures.frozen.inputs.T.contiguous()
    published = PAPER["samples"] / published_rate(values[:, 0], directions)
    rows, firsts = [], {}
    for family, label, config, width in progress(variants(default)):
        widths = (WIDTHS[0], width, width, WIDTHS[-1])
        if width not in firsts:  # once for all materials: no part of a material's seconds
            firsts[width] = first_field(values[:, :1], directions, default, seed, widths)
        start = time.process_time()
        result = fit(values, directions, firsts[width], config, seed, widths)
        seconds = (time.process_time() - start) / len(bases)
        fields = evaluate_inputs(result["weights"], inputs, widths).transpose(1, 2)
        psnr, ssim = compare_pictures(expected, to_srgb8(pictures.frozen.pictures(fields)))
        losses = [result[key].mean().item() for key in ("loss_grid", "loss_uniform")]
        rows.append((family, label, seconds, published / seconds, *losses, psnr.mean(), psnr.min(), ssim.mean()))
    columns = ["family", "label", "seconds", "speedup", "loss_grid", "loss_uniform", "psnr", "psnr_worst", "ssim"]
    return pd.DataFrame(rows, columns=columns)
