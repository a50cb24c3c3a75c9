"""Put the last full results into the README: `python -m neumat.reporting.readme results README.md`."""

import sys
from pathlib import Path

import pandas as pd

from neumat.errors import NeumatError
from neumat.files import atomic_path
from neumat.reporting.tables import table2_markdown
from neumat.tables import read_table

START, END = "<!-- results: made by `make readme` -->", "<!-- end of results -->"
PAPERS = ["brdf_l1", "rmse", "neg_psnr", "neg_ssim"]
CHARTS = {  # picture: what it shows
    "fit-psnr.png": "Chart 1: rendered PSNR of the fits against the seconds that one material takes",
    "fit.png": "Chart 1: held-out loss of the fits against the seconds that one material takes",
    "sampling.png": "Chart 2: 1-NNA (BRDF-L1) of the samples against the seconds of sampling",
    "training.png": "Chart 2: 1-NNA (BRDF-L1) of the samples against the seconds of training",
    "bsdf.png": "Chart 4: PSNR of pictures against their time, by how directions are drawn",
}

REQUESTS = {
    "figures/by-text.png": "Materials from prompts that no training text holds; rendered with Mitsuba 3",
    "figures/by-type.png": "Materials by type; rendered with Mitsuba 3",
    "figures/by-image.png": "Materials from pictures (left) of held-out materials; rendered with Mitsuba 3",
    "figures/by-category.png": "Materials of each category, by rejection; rendered with Mitsuba 3",
    "charts/guidance.png": "Chart 3: how well requests are met, diversity and invalid draws against the guidance scale",
    "charts/constrained.png": "Seconds that a material of each category costs, by rejection and by request",
}

SCENES = ("studio", "mirror", "shelf")  # beside the hero, which the README's text shows


def results(folder):
    """Return the Markdown of the tables in `folder`: the run's cost, the fits, Table 2 under `parity`, novelty.

    Then generalisation, materials on demand and the charts, as far as they have been made.
    """
    tables = {name: read_table(folder / "tables" / f"{name}.csv") for name in ("run", "fit-summary", "unconditional")}
    novelty = read_table(folder / "tables" / "novelty.csv")
    run = tables["run"]
    total, elapsed = (run[(run["stage"] == "run") & (run["job"] == job)].iloc[0] for job in ("total", "elapsed"))
    lines = [
        f"Made on {elapsed.ended} by {elapsed.machine}: {elapsed.wall_s / 60:.0f} minutes, {total.cpu_s / 60:.0f} "
        f"minutes of CPU time, peak {total.peak_mib / 1024:.1f} GiB in one job (`results/tables/run.csv`).",
        "",
        "Fields against the tables that they were fitted to, over the 400 base materials:",
        "",
        _table(tables["fit-summary"]),
        "",
    ]
    lines += [_table2(tables["unconditional"], "parity")]
    lines += ["All protocols, metrics and distances: `results/tables/unconditional.md`.", ""]
    keep = (novelty["protocol"] == "parity") & (novelty["distance"] == "brdf_l1_log")
    lines += [
        "### Novelty, protocol `parity`",
        "",
        "Distance (BRDF-L1-log) of samples to their nearest training material, beside the held-out materials' own:",
        "",
        _table(novelty[keep].drop(columns=["protocol", "distance"])),
    ]
    folds = folder / "tables/generalisation.csv"
    if folds.exists():
        lines += ["", _table2(read_table(folds), "generalisation").rstrip()]
    lines += _on_demand(folder)
    fits = folder / "charts/fit.csv"
    if fits.exists():
        lines += [
            "",
            "### Speed and accuracy",
            "",
            "Some materials fitted with the default and by M3ashy's schedule. `seconds` of CPU time per material, "
            "its share of the first field, `first_seconds`, included. The published loop fits one material at a time: "
            "`rate_ratio` compares samples per second; `speedup_m3ashy` and `speedup_nbrdf` compare the time of a "
            "material, for the samples that the released programs of M3ashy and Neural-BRDF visit:",
            "",
        ]
        fits = read_table(fits)
        lines.append(_table(fits[fits["family"].isin(["default", "paper"])].drop(columns="family")))
    lines += _scenes(folder)
    for name, meaning in CHARTS.items():
        if (folder / "charts" / name).exists():
            lines += ["", f"![{meaning}]({folder}/charts/{name})"]
    return "\n".join(lines)


def _on_demand(folder):
    """Return the lines on conditional and constrained synthesis, none where they have not been made."""
    path = folder / "tables/conditional.csv"
    if not path.exists():
        return []
    table = read_table(path)
    shown = table.pivot_table("value", ["modality", "use", "measure"], "method", sort=False).reset_index()
    lines = [
        "",
        "### Materials on demand",
        "",
        "How well samples follow their requests, by judges that share nothing with the encoders or the model but what "
        "words for colour and gloss mean. "
        "Distances are BRDF-L1-log, RMSE that of pictures; `rank of the prompt`: median among all reported prompts. "
        "`use`: `earlier` for prompts on which settings had been chosen, `report` for what no setting was chosen on:",
        "",
        _table(shown),
        "",
        "Materials of one category by rejection from the unconditional model, and by the model asked for it:",
        "",
    ]
    constrained = read_table(folder / "tables/constrained.csv")
    columns = ["category", "way", "found", "tried", "acceptance", "seconds_per_accepted", "training_share", "one_nna"]
    lines.append(_table(constrained[columns]))
    for name, meaning in REQUESTS.items():
        lines += ["", f"![{meaning}]({folder}/{name})"]
    return lines


def _scenes(folder):
    """Return the lines on the models that scenes need, none where they have not been made."""
    path = folder / "charts/models.csv"
    if not path.exists():
        return []
    models, ladder = read_table(path), read_table(folder / "tables/ladder.csv")
    columns = ["scene", "tolerance", "materials", "kept", "bytes", "bytes_share", "ns", "ns_share", "seconds_share"]
    marks = ["fit_error", "below_fit_error", "exceeds"]
    lines = [
        "",
        "What scenes need of their materials, as shares of 675 weights everywhere (`kept`: materials that need all of "
        "them), and the mean FLIP of the worst object, predicted and measured against the materials' tables (sampled "
        "ones: their fields); `noise` is that between two pictures of the same materials, `fit_error` that of the fields. "
        "`below_fit_error` and `exceeds` count the objects whose fields miss the tolerance, and those that exceed it:",
        "",
        _table(models[[*columns, "predicted", "measured", "noise", *marks, "upgrades"]]),
        "",
        f"![Chart 5: cost of a scene's models against the error that it may show]({folder}/charts/models.png)",
        "",
        "The ladder of models of four measured materials, over all angles; `error`: share of what is reflected:",
        "",
        _table(ladder),
    ]
    for name in SCENES:
        lines += ["", f"![The scene {name}; rendered with Mitsuba 3]({folder}/scenes/{name}.png)"]
    return lines


def _table2(table, protocol):
    """Return 1-NNA and COV of `table` under one protocol, on the paper's distances, as Markdown."""
    shown = table[(table["protocol"] == protocol) & table["distance"].isin(PAPERS)]
    text = table2_markdown(shown[shown["metric"].isin(["one_nna", "cov"])])
    return text.replace("### ", "#### ").replace(f"## {protocol}", f"### Table 2, protocol `{protocol}`")


def update(folder, readme):
    """Replace what stands between the markers of the README. Raises NeumatError where they are missing."""
    text = Path(readme).read_text(encoding="utf-8")
    if START not in text or END not in text:
        raise NeumatError(readme, f"the markers {START} and {END}", "none")
    before, after = text.split(START)[0], text.split(END)[1]
    with atomic_path(readme) as path:
        path.write_text(f"{before}{START}\n\n{results(Path(folder))}\n\n{END}{after}", encoding="utf-8")


def _table(frame):
    rows = [frame.columns, ["---"] * frame.shape[1], *([_cell(value) for value in row] for row in frame.to_numpy())]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def _cell(value):
    if pd.isna(value):
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    try:
        update(*sys.argv[1:])
    except (NeumatError, FileNotFoundError) as error:
        sys.exit(str(error))
