"""The figures of the embedded materials' data card: `python -m neumat.studies.embedded_card merl_nbrdf.zip`."""

import argparse
import sys

import torch

from neumat.brdf.coordinates import above_horizon, cosines, grid_angles, half_difference
from neumat.brdf.embedded import Embedded, embedded_names
from neumat.errors import NeumatError
from neumat.fields.distill import read_teachers
from neumat.fields.field import evaluate_inputs
from neumat.metrics.pictures import compare_pictures
from neumat.render.scene import to_srgb8
from neumat.render.sphere import FrozenSphere, render_fields


def card(zip_path):
    """Return [(name, mean |delta log(1 + f cos)| over the valid grid entries, psnr dB, ssim)] of the embedded 100."""
    names, teachers = read_teachers(zip_path)
    if names != embedded_names():
        raise NeumatError(zip_path, "the NBRDFs that the embedded materials were made from", "others")
    angles = grid_angles(torch.nonzero(above_horizon())[:, 0])
    inputs, cosine = half_difference(*angles), cosines(*angles)[0][:, None]
    frozen, rows = FrozenSphere(), []
    for i, name in enumerate(names):
        material = Embedded(i)
        expected = evaluate_inputs(teachers[i : i + 1], inputs)[0]
        change = (torch.log1p(material.eval(*angles) * cosine) - torch.log1p(expected * cosine)).abs().mean().item()
        values = material.eval(frozen.theta_h, frozen.theta_d, frozen.phi_d).T[None]
        found = to_srgb8(frozen.pictures(values))
        (psnr,), (ssim,) = compare_pictures(render_fields(frozen, teachers[i : i + 1]), found)
        rows.append((name, change, psnr, ssim))
    return rows


def main(argv=None):
    """Print one line a material and the summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("zip")
    try:
        rows = card(parser.parse_args(argv).zip)
    except NeumatError as error:
        sys.exit(str(error))
    for name, change, psnr, ssim in rows:
        print(f"{name:28s} {change:.6f} {psnr:6.2f} dB {ssim:.5f}")
    change, psnr, ssim = torch.tensor([row[1:] for row in rows]).T
    print(f"delta log(1 + f cos): median {change.median():.6f}, worst {change.max():.6f}")
    print(f"rendered PSNR: median {psnr.median():.2f} dB, worst {psnr.min():.2f} dB; SSIM worst {ssim.min():.5f}")


if __name__ == "__main__":
    main()
