"""Make new materials on demand: `python -m neumat.synthesise --text "red plastic"`."""

import argparse
import os
import sys
from pathlib import Path

from neumat.errors import NeumatError

REQUESTS = ("type", "category", "text", "image", "colour")
SHOWN, COLUMNS, PIXELS = 60, 6, 256  # rows and columns of the preview, pixels of each material


def parser():
    """Return the command line's parser."""
    made = argparse.ArgumentParser(prog="python -m neumat.synthesise", description=__doc__)
    words = made.add_mutually_exclusive_group()
    words.add_argument("--text", help='words, such as "red plastic"')
    words.add_argument("--requests", type=Path, help="a file of such words, one request a line")
    made.add_argument("--type", help="a type of the training materials, such as metallic-paint")
    made.add_argument("--category", help="a category of reflectance, such as mirror")
    made.add_argument("--image", type=Path, help="a photo or render of a material")
    made.add_argument("--colour", help='a number such as "#b87333", or a name such as "navy blue"')
    made.add_argument("--force", action="store_true", help="serve a text of which nothing is known")
    made.add_argument("-n", type=int, default=6, help="how many materials for each request (6)")
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
    made.add_argument("--model", type=Path, help="a trained model (the one that comes with neumat)")
    made.add_argument("--output", type=Path, default=Path("materials"), help="folder for what is made (materials)")
    made.add_argument(
        "--preview", type=Path, help="the picture of what is made, a .png file (preview.png in that folder)"
    )
    made.add_argument("--merl", action="store_true", help="write each as a MERL .binary file too (33 MB)")
    return made


def main(arguments=None):
    """Write the weights of the materials, (n, 675), or (requests, n, 675) of a file of requests, their picture and, if
    asked for, MERL tables.

    All that takes long to import is imported after the options have been read.
    """
    options = parser().parse_args(arguments)
    texts = checked(options)
    from tqdm import tqdm

    with tqdm(total=1, desc="reading the model", disable=None, leave=False) as bar:
        weights, drawn = _answers(options, texts, bar)
        bar.set_description("writing")
        _write(options, weights)
    made = f"{weights.shape[0] * weights.shape[1]} materials"
    print(f"{made} in {options.output}, shown in {_preview(options)} (of {drawn} drafts)")


def checked(options):
    """Return the texts that are asked for, [None] without any. Raises NeumatError for what can be known to be wrong
    before the model is read."""
    if all(getattr(options, name) is None for name in (*REQUESTS, "requests")):
        names = ", ".join(f"--{name}" for name in (*REQUESTS, "requests"))
        raise NeumatError("request", f"one or more of {names}", "none")
    if _preview(options).suffix.lower() != ".png":
        raise NeumatError("--preview", "the name of a .png file", options.preview)
    for option, path in (("--output", options.output), ("--preview", _preview(options).parent)):
        there = next(parent for parent in (path, *path.absolute().parents) if os.path.exists(parent))
        if not there.is_dir():
            raise NeumatError(option, "a folder, or a name for a new one", f"a file, {there}")
        if not os.access(there, os.W_OK):
            raise NeumatError(option, "a folder that can be written to", there)

    from neumat.conditions.text_input import check_text

    texts = [options.text] if options.requests is None else _lines(options.requests)
    for text in texts:
        if text is not None:
            check_text(text)
    return texts


def _answers(options, texts, bar):
    """Return (weights (t, n, 675), how many were drawn for them); `bar` shows how far it is."""
    from neumat.brdf.categories import check_category
    from neumat.conditions.colour_names import read_colour
    from neumat.conditions.photos import read_photo
    from neumat.conditions.synthesis import Synthesiser, check_numbers

    def progress(steps):
        bar.reset(len(steps))
        bar.set_description("making materials")
        for step in steps:
            yield step
            bar.update()

    if options.category is not None:
        check_category(options.category)
    guidance, candidates = options.guidance, options.candidates
    check_numbers(options.n, 0.0 if guidance is None else guidance, 1 if candidates is None else candidates)
    if options.colour is not None:
        read_colour(options.colour)
    asked = {"type": options.type, "category": options.category, "colour": options.colour, "force": options.force}
    asked["image"] = None if options.image is None else read_photo(options.image)
    synthesiser = Synthesiser.load(options.model)
    return synthesiser.synthesise_each(texts, options.n, options.seed, guidance, candidates, progress, **asked)


def _write(options, weights):
    """Write what `main` says of weights (t, n, 675)."""
    import numpy as np

    from neumat.export import export
    from neumat.files import atomic_path
    from neumat.render.sphere import FrozenSphere, render_fields
    from neumat.reporting.sheets import contact_sheet, save_image

    one = options.requests is None
    with atomic_path(options.output / "weights.npy") as temporary:
        np.save(temporary, weights[0].numpy() if one else weights.numpy())
    if options.merl:
        for k, of_request in enumerate(weights):
            for j, material in enumerate(of_request):
                export(material, "merl", options.output, f"material-{j}" if one else f"material-{k}-{j}")
    # A row for each of several requests.
    shown = weights[0, : SHOWN * COLUMNS] if one else weights[:SHOWN, :COLUMNS].flatten(0, 1)
    pictures = render_fields(FrozenSphere(PIXELS, subpixels=2), shown)
    save_image(contact_sheet(pictures, min(COLUMNS, weights.shape[1])), _preview(options))


def _preview(options):
    return options.output / "preview.png" if options.preview is None else options.preview


def _lines(path):
    """Return the lines of a text file that are not blank. Raises NeumatError for another file, and for none."""
    from neumat.files import reading

    with reading(path, "a text file (UTF-8) with one request a line"):
        lines = [line.strip() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    if not lines:
        raise NeumatError(path, "one request a line", "no words")
    return lines


if __name__ == "__main__":
    try:
        main()
    except NeumatError as error:
        sys.exit(str(error))
