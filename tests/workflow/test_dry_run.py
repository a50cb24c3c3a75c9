"""Every target and every single stage can be planned from nothing."""

import re
import subprocess

import pytest
from runner import ROOT, SMOKE, command, planned, run

RULES = [
    name
    for file in sorted((ROOT / "workflow/rules").glob("*.smk"))
    for name in re.findall(r"^(?:use rule \w+ as|rule) (\w+)(?: with)?:", file.read_text(), re.MULTILINE)
]


def test_smoke_plans_every_rule(tmp_path):
    assert planned(tmp_path, "--", "smoke") == set(RULES) - {"btf_measured"}  # see test_own_btf.py


@pytest.mark.parametrize("overlays", [(), (ROOT / "config/paper.yaml",)], ids=["default", "paper"])
def test_default_target_plans_data_to_report(tmp_path, overlays):
    rules = planned(tmp_path, overlays=overlays)
    assert set(RULES) - rules == {
        "chart_fit",
        "chart_sampling",
        "chart_bsdf",
        "chart_models",
        "scene_models",
        "scene_preview",
        "ladder",
        "text_ablation",
        "generalisation_table",
        "generalisation_coverage",
        "export",
        "dense_table",
        "packaged_projection",
        "packaged_tune",
        "pack",
        "btf_truth",
        "btf_synthesis",
        "btf_synthesised",
        "btf_compared",
        "btf_tables",
        "btf_relief",
        "btf_bench",
        "btf_chart",
        "btf_stability",
        "btf_measured",
        "btf_queries",
    }


def test_every_stage_without_wildcards_is_a_target_of_its_own(tmp_path):
    stages = set(RULES) - {"fit_shard", "train", "sample", "score", "run_table"}
    stages -= {"coverage", "constrained", "constrained_sheet", "projection", "tune", "export"}
    stages -= {"scene", "scene_preview", "scene_models", "dense_shard"}
    stages -= {"btf_shard", "btf_capture", "btf_truth", "btf_fit", "btf_quality", "btf_synthesis", "btf_ours"}
    stages -= {"btf_synthesised", "btf_compared", "btf_measured"}
    assert stages <= planned(tmp_path, "--", *stages)


def test_one_job_per_material_can_be_asked_for(tmp_path):
    (tmp_path / "mine.yaml").write_text("fit: {materials_per_job: 1}")
    assert "fit_shard" in planned(
        tmp_path, "--", "results/neumerl/shards/10-of-10.h5", overlays=(SMOKE, tmp_path / "mine.yaml")
    )


def test_the_ablation_tunes_no_second_model_of_the_configured_power(tmp_path):
    done = run(tmp_path, "--dry-run", "--", "text_ablation", overlays=())
    tuned = set(re.findall(r"output: (results/conditional/model\S*)", done.stdout + done.stderr))
    assert tuned == {f"results/conditional/model{power}.safetensors" for power in ("", "@0", "@0.5")}


def test_measured_files_are_inputs_of_the_fits_that_are_judged_on_them(tmp_path):
    """And of nothing else: another folder leaves the run's own fits as they are."""
    for name in ("a.bsdf", "b.binary", "b.h5", "c.h5", "notes.txt"):
        (tmp_path / name).touch()
    (tmp_path / "mine.yaml").write_text(f"fit: {{measured: {tmp_path}}}")
    overlays = (SMOKE, tmp_path / "mine.yaml")
    done = run(tmp_path, "--dry-run", "--", "fit_quality", "chart_fit", overlays=overlays)
    inputs = {
        found[1]: set(found[2].split(", "))
        for found in re.finditer(r"rule (\w+):\n    input: (.*)", done.stdout + done.stderr)
    }
    measured = {str(tmp_path / name) for name in ("a.bsdf", "b.binary", "b.h5")}
    assert {rule for rule, files in inputs.items() if files & measured} == {"fit_measured", "chart_fit"}
    assert inputs["fit_measured"] == {*measured, "results/neumerl/first.h5"}


def test_a_folder_of_measured_files_that_cannot_be_split_is_refused_at_the_start(tmp_path):
    (tmp_path / "only.bsdf").touch()
    (tmp_path / "mine.yaml").write_text(f"fit: {{measured: {tmp_path}}}")
    overlays = (SMOKE, tmp_path / "mine.yaml")
    done = subprocess.run(command(tmp_path, "--dry-run", overlays=overlays), capture_output=True, text=True)
    assert done.returncode != 0
    assert "config key fit.measured: expected a folder of at least two" in done.stderr and "only" in done.stderr
    assert "Traceback" not in done.stderr
