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


def variants(default, paper_samples):
    """Return [(family, label, config, width)]: the default, one change at a time, each optimiser alone, and the papers'
    schedule with its `paper_samples`."""
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
    return [*found, ("paper", "paper's schedule", default | PAPER | {"samples": paper_samples}, 21)]


def _shared(default, share):
    polish = default["polish"] | {"samples": int(share * default["polish"]["samples"])}
    return default | {"samples": int(share * default["samples"]), "polish": polish}


def _millions(config):
    return f"{(config['samples'] + config['polish']['samples']) / 1e6:.3g} M"


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


def sweep(augmerl_path, sources_path, default, paper_samples, materials, size, seed, progress=iter):
    """Return a DataFrame: family, label, seconds (per material), loss_grid, loss_uniform, psnr, psnr_worst, ssim.

    default: the section `fit`; paper_samples: of the papers' schedule; materials: how many base materials, evenly
    spread over all. Seconds are CPU seconds of one thread in this run, which a busy machine distorts least; `speedup`
    is against the published loop at the papers' sample count, measured beside it.
    """
    store = AugMerl(augmerl_path, sources_path)
    directions = Directions(store.entries, seed)
    bases = np.unique(np.linspace(0, store.n - 1, materials).round().astype(int)) * len(PERMUTATIONS)
    values = load_values(store, bases)
    pictures = Pictures(store, size)
    expected = pictures.tables(bases)
    inputs = pictures.frozen.inputs.T.contiguous()
    published = paper_samples / published_rate(values[:, 0], directions)
    rows, firsts = [], {}
    for family, label, config, width in progress(variants(default, paper_samples)):
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
