"""The page of results and the README's headline figures, from one run: `python -m neumat.reporting.docs results docs`.

Writes docs/results.md, the pictures that the pages show, and what stands between the markers of the README beside the
folder. Needs a finished run of `all`; what `charts` and `generalisation` add is shown where they have been made.
"""

import argparse
import io
import sys
from pathlib import Path

from PIL import Image

from neumat.errors import NeumatError
from neumat.files import atomic_path
from neumat.reporting.btf_sections import BTF_SECTIONS
from neumat.reporting.headline import headline
from neumat.reporting.markdown import frame_markdown
from neumat.reporting.result_sections import SECTIONS
from neumat.tables import read_table

PAGE = (*SECTIONS, *BTF_SECTIONS)
PICTURES = [name for section in PAGE for name in section.pictures]
START, END = "<!-- headline: made by `make readme` -->", "<!-- end of headline -->"
WIDTH, BYTES = 1100, 64_000  # of a picture, at most
QUALITIES = range(85, 35, -10)  # of WebP, tried in turn
TOTAL_BYTES = 3_000_000  # of all pictures of docs/


def write_docs(results, docs):
    """Write results.md and its pictures into the folder `docs`, and the headline table into the README beside it.

    results: the folder of a finished run of `all`. Everything is checked and drawn before the first file is written.
    Raises NeumatError where the run or the README's markers are missing, or the pictures are too large in all.
    """
    results, docs = Path(results), Path(docs)
    if not (results / "tables/run.csv").is_file():
        raise NeumatError(results, "a finished run with tables/run.csv; run `make` first", "none")
    readme = docs.parent / "README.md"
    text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    if START not in text or END not in text:
        raise NeumatError(readme, f"the markers {START} and {END}", "none")
    pictures = {
        f"{Path(name).stem}.webp": small_picture(results / name) for name in PICTURES if (results / name).is_file()
    }
    total = sum(map(len, pictures.values()))
    if total > TOTAL_BYTES:
        raise NeumatError(docs, f"pictures of at most {TOTAL_BYTES} bytes in all", total)
    page = results_page(results)
    before, after = text.split(START)[0], text.split(END)[1]

    docs.mkdir(parents=True, exist_ok=True)
    for path in docs.glob("*.webp"):
        if path.name not in pictures:
            path.unlink()
    for name, data in pictures.items():
        with atomic_path(docs / name) as path:
            path.write_bytes(data)
    for file, content in (
        (docs / "results.md", page),
        (readme, f"{before}{START}\n\n{run_line(results)}\n\n{headline(results)}\n\n{END}{after}"),
    ):
        with atomic_path(file) as path:
            path.write_text(content, encoding="utf-8")


def small_picture(path):
    """Return a picture as WebP (bytes), at most WIDTH pixels wide and of BYTES bytes, at the best quality that fits.

    Where none fits, the picture is halved.
    """
    with Image.open(path) as image:
        picture = image.convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    while True:
        for quality in QUALITIES:
            buffer = io.BytesIO()
            picture.save(buffer, "WEBP", quality=quality, method=4)
            if buffer.tell() <= BYTES:
                return buffer.getvalue()
        picture = picture.reduce(2)


def run_line(results):
    """Return the sentence that names the run: when, where, how long."""
    run = read_table(results / "tables/run.csv")
    total, elapsed = (run[(run["stage"] == "run") & (run["job"] == job)].iloc[0] for job in ("total", "elapsed"))
    return (
        f"From the run of `all` that ended on {elapsed.ended} ({elapsed.machine}): {total.cpu_s / 60:.0f} minutes of "
        f"CPU time, {elapsed.wall_s / 60:.0f} by the clock, at most {total.peak_mib / 1024:.1f} GiB in one job."
    )


def results_page(results):
    """Return the Markdown of results.md: each section's text, tables and pictures, as far as the run made them."""
    lines = [
        "# Results",
        "",
        "<!-- Made by `make readme`; edits are lost. -->",
        "",
        f"{run_line(results)} The samples are the first of each draw; none was picked. "
        "[figures.md](figures.md) says how to read the figures, which data chose the settings, and who judges; "
        "[leakage.md](leakage.md) how it is tested that no judge or model has seen what it is measured on.",
    ]
    for section in PAGE:
        lines += ["", f"## {section.title}", ""]
        missing = [name for name in section.needs if not (results / name).is_file()]
        if missing:
            lines.append(f"Not part of this run: {section.make} makes it (`results/{missing[0]}`).")
            continue
        lines.append(section.text)
        for show in section.tables:
            shown = show(results)
            if shown is not None:
                lines += ["", shown if isinstance(shown, str) else frame_markdown(shown)]
        for name, caption in section.pictures.items():
            if (results / name).is_file():
                lines += ["", f"![{caption}]({Path(name).stem}.webp)"]
    return "\n".join(lines) + "\n"


def main(arguments=None):
    """Write the pages; a NeumatError ends in one line."""
    parser = argparse.ArgumentParser(prog="python -m neumat.reporting.docs", description=__doc__.splitlines()[0])
    parser.add_argument("results", help="folder of a finished run of `all`")
    parser.add_argument("docs", help="folder of the pages")
    options = parser.parse_args(arguments)
    try:
        write_docs(options.results, options.docs)
    except NeumatError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
