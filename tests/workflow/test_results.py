"""What a finished run leaves."""

import pandas as pd
import pytest
from PIL import Image
from runner import run

from neumat.errors import NeumatError
from neumat.scenes.materials import Materials


def test_run_table_has_every_stage_that_ran(smoke):
    table = pd.read_csv(smoke / "results/tables/run.csv", index_col="stage")
    stages = {path.name.removesuffix(".tsv") for path in (smoke / "results/benchmarks").iterdir()}
    ran = set(table.index) - {"run"}  # the total
    assert ran <= stages and {"sources", "fit_shard", "train", "sample", "score"} <= ran
    assert (table["wall_s"].dropna() > 0).all()
    assert set(table.loc["fit_shard", "job"]) == {"1-of-2", "2-of-2", "total"}


def test_every_job_has_a_log(smoke):
    benchmarks = {path.relative_to(smoke / "results/benchmarks") for path in smoke.glob("results/benchmarks/**/*.tsv")}
    logs = {
        path.relative_to(smoke / "results/logs").with_suffix(".tsv") for path in smoke.glob("results/logs/**/*.log")
    }
    assert benchmarks <= logs


def test_report_is_one_small_file(smoke):
    run(smoke, "--report", "report.html", "--", "smoke")
    assert 1e5 < (smoke / "report.html").stat().st_size < 20e6


def test_nothing_half_written_is_left(smoke):
    assert not list(smoke.glob("results/**/*.partial*"))


def test_scenes_have_their_pictures_and_models_that_say_whether_they_keep_the_tolerance(smoke):
    sizes = {path: Image.open(smoke / "results/scenes" / path).size for path in ("mirror.png", "preview/mirror.png")}
    assert list(sizes.values()) == [(48, 32), (24, 16)]
    chosen = pd.read_csv(smoke / "results/tables/scene_models.csv")
    assert set(chosen["object"]) == {"floor", "ball"} and len(chosen) == 3
    # At toy size the fields themselves miss the tolerance: the table has to say so.
    assert (chosen["exceeds"] == (chosen["measured"] > chosen["tolerance"])).all()
    assert (chosen["below_fit_error"] == (chosen["fit_error"] > chosen["tolerance"])).all()
    ladder = pd.read_csv(smoke / "results/tables/ladder.csv")
    fields = {f"field-{width}" for width in (4, 8, 10, 12, 16, 21)}
    assert set(ladder["rung"]) == {"lambert", "glossy", "sgd", "table"} | fields
    assert (ladder["psnr"][ladder["rung"] == "table"] > 100).all()


def test_materials_of_scenes_are_found_by_name_number_and_rank(smoke):
    results = smoke / "results"
    samples = results / "samples/parity/hyperdiffusion.h5"
    materials = Materials(results / "neumerl/neumerl.h5", results / "augmerl/manifest.tsv", samples)
    assert materials.find("alum-bronze@rbg")[1].shape == (675,)
    lowest, highest = (materials.find(f"samples@{rank}")[0] for rank in (0, 1))
    assert lowest != highest and lowest.startswith("sample-")
    assert "@" not in materials.find("sources@0.5")[0]
    for name in ("vibranium", "sample-100000", "sources@1.5", "sources@"):
        with pytest.raises(NeumatError, match="material: expected a name of the manifest"):
            materials.find(name)


def test_settings_are_chosen_on_other_requests_than_are_reported(smoke):
    results = smoke / "results"
    for path in ("charts/guidance.csv", "tables/text_ablation.csv"):
        assert set(pd.read_csv(results / path)["use"]) == {"validation"}
    table = pd.read_csv(results / "tables/conditional.csv")
    reported = {("type", "report"), ("text", "earlier"), ("text", "report"), ("image", "report")}
    assert set(zip(table["modality"], table["use"], strict=True)) == reported
    types = pd.read_csv(results / "tables/conditional_types.csv").set_index("type")
    assert types.loc["all types", "unmet"] == types["unmet"].iloc[:-1].sum()
