"""Make the embedded 100 from the published NBRDFs: `python -m neumat.fields.distill merl_nbrdf.zip`.

Each published network (6-21-21-3 ReLU, Sztrajman et al. 2021, MIT) teaches a wider one with smooth activations, so
that fitting the embedded materials again with the published architecture is a real test.
"""

import argparse
import io
import math
import sys
import zipfile
from concurrent.futures import ProcessPoolExecutor
from importlib.resources import files
from pathlib import Path

import h5py
import torch
from safetensors.torch import save_file
from tqdm import tqdm

from neumat.brdf import embedded
from neumat.brdf.coordinates import above_horizon, cosines, grid_angles, half_difference
from neumat.errors import NeumatError
from neumat.fields.field import log_reflectance
from neumat.fields.layout import WIDTHS, unpack
from neumat.fields.optimisers import Soap
from neumat.files import atomic_path
from neumat.seeds import torch_generator

STEPS, BATCH, GROUP, LEARNING_RATE = 11000, 512, 10, 6e-3
GRID_SHARE = 0.75  # of a batch: drawn from the grid entries, the rest by uniform angles
WARMUP = 0.05  # of the steps
SHARPNESS = 36.0


def read_teachers(path):
    """Return (names, weights (n, 675)) of the Keras files in a zip of NBRDFs.

    Raises NeumatError where the file is no zip or holds no NBRDF.
    """
    if not zipfile.is_zipfile(path):
        raise NeumatError(path, "a zip of NBRDF .h5 files", "no zip file")
    names, weights = [], []
    with zipfile.ZipFile(path) as archive:
        for member in sorted(m for m in archive.namelist() if m.endswith(".h5")):
            with h5py.File(io.BytesIO(archive.read(member))) as file:
                layers = [file[f"dense_{k}/dense_{k}"] for k in (1, 2, 3)]
                parts = [torch.tensor(layer[key][()]).flatten() for layer in layers for key in ("kernel:0", "bias:0")]
            names.append(Path(member).stem)
            weights.append(torch.cat(parts))
    if not names:
        raise NeumatError(path, "NBRDF .h5 files inside", "none")
    order = sorted(range(len(names)), key=names.__getitem__)
    return [names[i] for i in order], torch.stack([weights[i] for i in order]).float()


def sample_directions(valid, generator):
    """Return (theta_h, theta_d, phi_d), (BATCH,): grid entries (dense in the highlight) and uniform angles."""
    dense = round(GRID_SHARE * BATCH)
    entries = valid[torch.randint(len(valid), (dense,), generator=generator)]
    angles = torch.stack(grid_angles(entries), 1)
    uniform = torch.rand(4 * BATCH, 3, generator=generator) * torch.tensor([math.pi / 2, math.pi / 2, math.pi])
    cos_i, cos_o = cosines(*uniform.T)
    uniform = uniform[(cos_i > 0) & (cos_o > 0)][: BATCH - dense]
    return torch.cat([angles, uniform]).T


def widen(teachers, generator):
    """Return student layers, (n, in + 1, out) with the bias as the last row, that start near their teachers (n, 675).

    silu(S x) / S is near relu(x). Every hidden layer holds the teacher's 21 units and fresh ones, whose outgoing
    weights start at 0.
    """
    layers = []
    for k, (kernel, bias) in enumerate(unpack(teachers)):
        a, b = embedded.WIDTHS[k], embedded.WIDTHS[k + 1]
        layer = torch.zeros(len(teachers), a + 1, b)
        layer[:, :a] = (torch.rand(a, b, generator=generator) * 2 - 1).mul(math.sqrt(3 / a))
        layer[:, kernel.shape[1] : a, : kernel.shape[2]] = 0
        layer[:, : kernel.shape[1], : kernel.shape[2]] = kernel * (SHARPNESS, 1, 1 / SHARPNESS)[k]
        layer[:, a, : bias.shape[1]] = bias * (SHARPNESS, SHARPNESS, 1)[k]
        layers.append(layer)
    layers[0][:, 1, : WIDTHS[1]] = 0  # the teacher's hy, always 0, is another input here
    return layers


def learning_rate(step):
    """Return the learning rate at `step`: a linear warm-up, then a half cosine down to 0."""
    phase = step / STEPS
    if phase < WARMUP:
        return LEARNING_RATE * phase / WARMUP
    return LEARNING_RATE * (1 + math.cos(math.pi * (phase - WARMUP) / (1 - WARMUP))) / 2


def distil(teachers):
    """Return the layers [(kernel (n, in, out), bias (n, out)), ...] of students of `teachers` (n, 675)."""
    torch.set_num_threads(1)  # one process a core beats threads on matrices this small
    generator = torch_generator(1, "distil")
    valid = torch.nonzero(above_horizon())[:, 0]
    parameters = [layer.requires_grad_() for layer in widen(teachers, generator)]
    optimisers = [Soap(parameter) for parameter in parameters]
    for step in range(STEPS):
        theta_h, theta_d, phi_d = sample_directions(valid, generator)
        inputs = half_difference(theta_h, theta_d, phi_d)
        cosine = cosines(theta_h, theta_d, phi_d)[0][:, None]
        layers = [(layer[:, :-1], layer[:, -1]) for layer in parameters]
        with torch.no_grad():
            target = torch.log1p(torch.expm1(log_reflectance(teachers, inputs)).clamp_min(0) * cosine)
        found = torch.log1p(
            torch.expm1(embedded.forward(layers, embedded.encode(theta_h, theta_d, phi_d))).clamp_min(-0.5) * cosine
        )
        gradients = torch.autograd.grad((found - target).abs().mean((1, 2)).sum(), parameters)
        for optimiser, gradient in zip(optimisers, gradients, strict=True):
            optimiser.step(gradient, learning_rate(step))
    return [(kernel.detach(), bias.detach()) for kernel, bias in layers]


def main(argv=None):
    """Write `brdf/data/embedded.safetensors`."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("zip", type=Path, help="merl_nbrdf.zip of the repository asztr/Neural-BRDF")
    args = parser.parse_args(argv)
    try:
        names, teachers = read_teachers(args.zip)
    except NeumatError as error:
        sys.exit(str(error))
    shards = teachers.split(GROUP)
    with ProcessPoolExecutor() as pool:
        groups = list(tqdm(pool.map(distil, shards), total=len(shards), desc="distil"))
    tensors = {"names": torch.tensor(list("\n".join(names).encode()), dtype=torch.uint8)}
    for k in range(len(embedded.WIDTHS) - 1):
        tensors[f"kernel{k}"] = torch.cat([group[k][0] for group in groups]).half()
        tensors[f"bias{k}"] = torch.cat([group[k][1] for group in groups]).half()
    with atomic_path(files("neumat.brdf").joinpath("data/embedded.safetensors")) as path:
        save_file(tensors, path)


if __name__ == "__main__":
    main()
