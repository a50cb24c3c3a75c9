"""Make new materials on demand: `python -m neumat.synthesise --text "red plastic"`."""

import argparse
import os
import sys
from pathlib import Path

import numpy as np
import torch

from neumat.brdf.categories import check_category
from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles
from neumat.brdf.merl import write_merl
from neumat.conditions.photos import read_photo
from neumat.conditions.synthesis import Synthesiser, check_numbers
from neumat.conditions.text_input import check_text
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.files import atomic_path
from neumat.render.mitsuba_scene import render_grid
from neumat.reporting.sheets import save_image

MODEL = "results/conditional/model.safetensors"
REQUESTS = ("type", "category", "text", "image")


def parser():
    """Return the command line's parser."""
    made = argparse.ArgumentParser(prog="python -m neumat.synthesise", description=__doc__)
    made.add_argument("--text", help='words, such as "red plastic"')
    made.add_argument("--type", help="a type of the training materials, such as metallic-paint")
    made.add_argument("--category", help="a category of reflectance, such as mirror")
    made.add_argument("--image", type=Path, help="a photo or render of a material")
    made.add_argument("-n", type=int, default=6, help="how many materials (6)")
    made.add_argument(
        "--guidance",
        type=float,
        help="how closely to follow the request, from -1 (as configured where the model was tuned: by default "
        "type 2, text 1, category and image 0, of several the least)",
    )
    made.add_argument(
        "--candidates",
        type=int,
        help="drawn for each material where a text or an image is given, to choose from (as configured where the model "
        "was tuned: by default 16)",
    )
    made.add_argument("--seed", type=int, default=0, help="another seed gives other materials (0)")
    made.add_argument("--model", type=Path, default=Path(MODEL), help=f"the trained model ({MODEL})")
    made.add_argument("--output", type=Path, default=Path("materials"), help="folder for what is made (materials)")
    made.add_argument("--merl", action="store_true", help="write each as a MERL .binary file too (33 MB)")
    return made


def main(arguments=None):
    """Write a picture of the materials, their weights (n, 675) and, if asked for, MERL tables into the folder."""
    options = parser().parse_args(arguments)
    asked = {key: getattr(options, key) for key in REQUESTS}
    check(options, asked)
    if options.image is not None:
        asked["image"] = read_photo(options.image)
    synthesiser = Synthesiser.load(options.model)
    weights, drawn = synthesiser.synthesise(options.n, options.seed, options.guidance, options.candidates, **asked)
    with atomic_path(options.output / "weights.npy") as temporary:
        np.save(temporary, weights.numpy())
    if options.merl:
        for k, table in enumerate(_tables(weights)):
            write_merl(options.output / f"material-{k}.binary", table)
    save_image(render_grid(weights, min(6, len(weights)), 256, 64), options.output / "preview.png")
    print(f"{len(weights)} materials in {options.output} (of {drawn} drafts)")


def check(options, asked):
    """Raise NeumatError for what can be known to be wrong before the model is read."""
    if all(value is None for value in asked.values()):
        raise NeumatError("request", f"one or more of {', '.join(f'--{name}' for name in REQUESTS)}", "none")
    if options.text is not None:
        check_text(options.text)
    if options.category is not None:
        check_category(options.category)
    check_numbers(
        options.n,
        0.0 if options.guidance is None else options.guidance,
        1 if options.candidates is None else options.candidates,
    )
    there = next(path for path in (options.output, *options.output.absolute().parents) if os.path.exists(path))
    if not there.is_dir():
        raise NeumatError("--output", "a folder, or a name for a new one", f"a file, {there}")
    if not os.access(there, os.W_OK):
        raise NeumatError("--output", "a folder that can be written to", there)


def _tables(weights):
    """Yield the dense MERL tables (1458000, 3) of weights (n, 675)."""
    entries = above_horizon().nonzero()[:, 0]
    for row in weights:
        table = np.full((ENTRIES, 3), np.nan, np.float32)
        table[entries] = torch.cat([evaluate(row[None], *grid_angles(part))[0] for part in entries.split(1 << 17)])
        yield table


if __name__ == "__main__":
    try:
        main()
    except NeumatError as error:
        sys.exit(str(error))
