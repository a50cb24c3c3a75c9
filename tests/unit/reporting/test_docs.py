"""The page of results and the README's headline, from small runs."""

import io

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from neumat.errors import NeumatError
from neumat.reporting import docs
from neumat.reporting.headline import headline
from neumat.reporting.result_sections import SECTIONS

README = f"# Title\n\nAbove.\n{docs.START}\nformer\n{docs.END}\nBelow.\n"


def save(table, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False)


def scores(protocol, methods):
    """Scores of every method by two distances, a different value in each row."""
    rows = [
        (method, protocol, metric, distance)
        for method in methods
        for metric in ("one_nna", "cov")
        for distance in ("brdf_l1", "neg_ssim")
    ]
    table = pd.DataFrame(rows, columns=["method", "protocol", "metric", "distance"])
    table["value"] = 50.0 + np.arange(len(table))
    return table.assign(low=49.0, high=99.0, n_ref=12, n_samples=12)


@pytest.fixture
def clone(tmp_path):
    """A repository with a README and the results of a small run of `all`, without charts and generalisation."""
    results = tmp_path / "results"
    (tmp_path / "README.md").write_text(README)
    run = [
        ("train", "a", 9.0, 90.0, 100.0, None, None),
        ("train", "b", 9.0, 30.0, 2048.0, None, None),
        ("sample", "sample", 1.0, 60.0, 50.0, None, None),
        ("train", "total", 18.0, 120.0, 2048.0, None, None),
        ("run", "total", 18.0, 180.0, 2048.0, None, None),
        ("run", "elapsed", 120.0, None, None, "2030-01-02", "2 cores of a test, x86_64"),
    ]
    columns = ["stage", "job", "wall_s", "cpu_s", "peak_mib", "ended", "machine"]
    save(pd.DataFrame(run, columns=columns), results / "tables/run.csv")
    methods = ["training-set", "hyperdiffusion", "copies", "interpolations"]
    save(scores("parity", methods), results / "tables/unconditional.csv")
    pixels = np.random.default_rng(0).integers(0, 256, (400, 1300, 3)).astype(np.uint8)
    (results / "figures").mkdir()
    Image.fromarray(pixels).save(results / "figures/grid.png")
    return tmp_path


def test_pages_are_made_of_a_run_of_all_alone(clone):
    docs.write_docs(clone / "results", clone / "docs")
    page, readme = ((clone / name).read_text() for name in ("docs/results.md", "README.md"))
    assert "2030-01-02" in page and "3 minutes of CPU time, 2 by the clock, at most 2.0 GiB" in page
    for section in SECTIONS:
        made = section.title in ("Materials sampled by the diffusion model", "Unconditional synthesis, `parity`")
        made |= section.title == "Cost of the run"
        assert (f"## {section.title}\n\nNot part of this run" not in page) == made, section.title
    assert "| train | 2 | 2 | 2048 |" in page  # jobs, minutes, MiB
    assert "![" in page and (clone / "docs/grid.webp").exists()
    assert readme.startswith("# Title\n\nAbove.\n") and readme.endswith("\nBelow.\n") and "former" not in readme


def test_each_headline_figure_stands_beside_its_null_and_its_ceiling(clone):
    lines = headline(clone / "results").splitlines()
    nna = next(line for line in lines if "1-NNA by BRDF-L1" in line)
    # hyperdiffusion's row is the 5th, copies' the 9th, interpolations' the 13th, the training set's the 1st.
    assert nna.endswith("| 54.0 | 58.0 (copies), 62.0 (interpolations) | 50.0 (training set) |")
    save(
        scores("generalisation", ["training-set", "hyperdiffusion", "copies"]),
        clone / "results/tables/generalisation.csv",
    )
    folds = next(line for line in headline(clone / "results").splitlines() if "held-out sources" in line)
    assert folds.endswith("| 54.0 | 58.0 (copies) | 50.0 (training set) |")


def test_what_a_run_did_not_make_leaves_no_figure(clone):
    lines = headline(clone / "results").splitlines()[2:]
    absent = [line for line in lines if line.endswith("| not part of this run |  |  |")]
    assert len(absent) == len(lines) - 4 and not any("nan" in line or "–" in line for line in lines)


def covered(shift):
    """A table of coverage where a null, blends, covers unseen materials by `shift` more than the model."""
    numbers = {"size": 100, "folds": "fold3", "novelty": 0.06, "novelty, any tint": 0.03, "precision": 0.05}
    rows = [("hyperdiffusion", 0, 0.04, 0.8), ("copies", 0, 0.05, 1.0), ("blends", 1, 0.04 - shift, 0.7)]
    table = pd.DataFrame(rows, columns=["method", "level", "coverage", "of_copies"]).assign(**numbers)
    table.loc[0, ["frontier", "behind", "behind_low", "behind_high"]] = [
        0.04 - shift,
        shift,
        shift - 0.01,
        shift + 0.01,
    ]
    table["null"] = ["blends 1", "", ""]
    own = pd.DataFrame([{"method": "held-out", "folds": "fold3", "novelty": 0.07, "precision": 0.06}])
    return pd.concat([table, own], ignore_index=True)


@pytest.mark.parametrize(
    ("shift", "said"), [(0.02, "A null dominates"), (0.0, "as well as the best null"), (-0.02, "better than any null")]
)
def test_the_first_line_of_the_results_says_whether_a_null_dominates(clone, shift, said):
    save(covered(shift), clone / "results/tables/coverage.csv")
    save(
        pd.DataFrame([(0.1, "training", 0.5, 80)], columns=["sigma", "side", "error", "materials"]),
        clone / "results/tables/memorisation.csv",
    )
    lines = headline(clone / "results").splitlines()
    assert said in lines[0] and "`blends 1`" in lines[0]
    assert "| unseen sources to the nearest of the samples, mean | 0.0400 | 0.0500 (copies)" in lines[4]
    docs.write_docs(clone / "results", clone / "docs")
    assert said in (clone / "docs/results.md").read_text()


def lines_of_fits(clone):
    lines = headline(clone / "results").splitlines()
    return [line for line in lines if line.startswith(("| fits", "| the same of measured materials"))]


def test_fits_of_measured_materials_stand_beside_those_of_embedded_ones(clone):
    rows = [("fitted", "psnr", 54.0), ("measured, validation", "psnr", 40.0), ("measured, reporting", "psnr", 50.0)]
    table = pd.DataFrame(rows, columns=["set", "quantity", "median"])
    save(table, clone / "results/tables/fit-summary.csv")
    ladder = pd.DataFrame({"rung": ["lambert", "sgd", "lambert"], "psnr": [10.0, 30.0, 20.0]})
    save(ladder, clone / "results/tables/ladder.csv")
    fitted, measured = lines_of_fits(clone)
    assert fitted.endswith("| 54.0 | 15 (Lambert); 30 (SGD) |  |") and measured.endswith("| 50.0 |  |  |")
    save(table[:1], clone / "results/tables/fit-summary.csv")
    assert "| not measured |" in lines_of_fits(clone)[1]


def test_requests_are_quoted_as_served_and_from_prompts_that_chose_nothing(clone):
    values = {
        "served, best of 4": 0.9,
        "null: unconditional": 0.3,
        "look-up: training": 0.8,
        "look-up: recoloured training": 0.85,
        "training set": 1.0,
        "conditional": 0.7,
    }
    rows = [
        ("text", use, m, "colour right", v / k) for k, use in ((2, "earlier"), (1, "report")) for m, v in values.items()
    ]
    table = pd.DataFrame(rows, columns=["modality", "use", "method", "measure", "value"])
    save(table, clone / "results/tables/conditional.csv")
    line = next(line for line in headline(clone / "results").splitlines() if "text: colour right" in line)
    assert line.endswith("| 0.90 | 0.30 (no request), 0.80 (looked up), 0.85 (looked up and recoloured) | 1.00 |")


def test_pictures_are_small_whatever_they_show(clone):
    docs.write_docs(clone / "results", clone / "docs")
    data = (clone / "docs/grid.webp").read_bytes()
    assert len(data) <= docs.BYTES
    assert Image.open(io.BytesIO(data)).width <= docs.WIDTH


def test_pictures_of_an_earlier_run_go(clone):
    (clone / "docs").mkdir()
    (clone / "docs/terrace.webp").write_bytes(b"old")
    docs.write_docs(clone / "results", clone / "docs")
    assert [path.name for path in (clone / "docs").glob("*.webp")] == ["grid.webp"]


def test_the_same_run_gives_the_same_pages(clone):
    docs.write_docs(clone / "results", clone / "docs")
    first = {path: path.read_bytes() for path in [clone / "README.md", *(clone / "docs").iterdir()]}
    docs.write_docs(clone / "results", clone / "docs")
    assert first == {path: path.read_bytes() for path in first}


@pytest.mark.parametrize(("broken", "words"), [("markers", "the markers"), ("run", "run `make` first")])
def test_a_missing_part_ends_in_one_line_before_anything_is_written(clone, broken, words, capsys):
    if broken == "markers":
        (clone / "README.md").write_text("# Title\n")
    else:
        (clone / "results/tables/run.csv").unlink()
    with pytest.raises(NeumatError, match=words):
        docs.write_docs(clone / "results", clone / "docs")
    assert not (clone / "docs").exists()
    with pytest.raises(SystemExit) as caught:
        docs.main([str(clone / "results"), str(clone / "docs")])
    assert "\n" not in str(caught.value)
