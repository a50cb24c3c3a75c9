"""What runs again, and what never does; what a run may depend on, and what not."""

import os
import shutil
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from runner import ROOT, SMOKE, command, planned, run

CONSTRAINED = {"constrained", "constrained_sheet", "constrained_table", "by_category"}
COVERAGE = {"coverage", "coverage_table", "generalisation_coverage"}  # of more samples than others, drawn by itself
AFTER_SAMPLING = (
    CONSTRAINED
    | COVERAGE
    | {
        "sample",
        "score",
        "unconditional",
        "generalisation_table",
        "novelty_figures",
        "grid",
        "method_sheet",
        "chart_sampling",
        "export",
        "physics",
        "scene",
        "scene_preview",
        "contact_sheet",
        "scene_models",
        "chart_models",
        "run_table",
    }
)
ON_DEMAND = {"conditional", "things", "chart_guidance", "stability_conditional", "text_ablation", "pack"}


def test_a_second_run_does_nothing(smoke):
    assert planned(smoke, "--", "smoke") == set()


@pytest.mark.parametrize("arguments", [["--cores", "1"], ["--cores", "2", "--set-threads", "train=1"]])
def test_cores_and_threads_rerun_nothing(smoke, arguments):
    assert planned(smoke, *arguments, "--", "smoke") == set()


@pytest.mark.parametrize(
    ("overlay", "rules"),
    [
        ("generative: {sampling: {seed: 1}}", AFTER_SAMPLING | ON_DEMAND - {"stability_conditional"}),
        (
            "evaluate: {bootstrap: 30}",
            {"unconditional", "generalisation_table", "coverage_table", "generalisation_coverage", "pack", "run_table"},
        ),
        ("generative: {methods: {hyperdiffusion: {steps: 20}}}", set()),  # the value that it has
        ("render: {grid_rows: 1}", {"grid", "run_table"}),
        ("scenes: {samples: 16}", {"scene", "run_table"}),
        ("scenes: {tolerance: 0.08}", {"chart_models", "run_table"}),
        (
            "btf: {synthesis: {stochastic: hex}}",
            {"btf_ours", "btf_synthesis", "btf_compared", "btf_tables", "run_table"},
        ),
        (
            "btf: {representations: {neumip: {samples: 30000}}}",
            {"btf_fit", "btf_quality", "btf_synthesis", "btf_compared", "btf_tables", "btf_chart", "run_table"},
        ),
        (
            "constrained: {rules: {mirror_width: 0.1}}",
            CONSTRAINED | ON_DEMAND | {"tune", "packaged_tune", "categories", "physics", "run_table"},
        ),
    ],
)
def test_a_changed_key_reruns_its_stage_and_what_follows(smoke, tmp_path, overlay, rules):
    (tmp_path / "mine.yaml").write_text(overlay)
    assert planned(smoke, "--", "smoke", overlays=(SMOKE, tmp_path / "mine.yaml")) == rules


def test_a_changed_hyperparameter_reruns_one_method(smoke, tmp_path):
    (tmp_path / "mine.yaml").write_text("generative: {methods: {vae-a: {latent: 5}}}")
    done = run(smoke, "--dry-run", "--", "smoke", overlays=(SMOKE, tmp_path / "mine.yaml"))
    assert done.stdout.count("rule train:") == 1 and "models/parity/vae-a.safetensors" in done.stdout


def test_code_counts_and_comments_do_not(smoke, tmp_path):
    for name in ("Snakefile", "workflow", "config", "profiles"):
        source = ROOT / name
        (shutil.copytree if source.is_dir() else shutil.copy)(source, tmp_path / name)
    assert planned(smoke, "--", "smoke", root=tmp_path) == set()
    script = tmp_path / "workflow/scripts/sample.py"
    text = script.read_text()
    script.write_text(f"# A comment.\n{text}# Another.\n")
    assert planned(smoke, "--", "smoke", root=tmp_path) == set()
    script.write_text(f"{text}\nprint('changed')\n")
    assert planned(smoke, "--", "smoke", root=tmp_path) == AFTER_SAMPLING - CONSTRAINED - COVERAGE - {"chart_sampling"}


def contents(folder):
    """Return all numbers of the stores of weights and samples in `folder`."""
    found = {}
    for path in sorted([folder / "results/neumerl/neumerl.h5", *(folder / "results/samples/parity").glob("*.h5")]):
        with h5py.File(path) as file:
            found[path.name] = file["weights" if path.stem == "neumerl" else "samples"][:]
    return found


def test_killed_then_finished_on_one_core_with_other_shards(smoke, tmp_path):
    """A kill loses the jobs in flight only; cores and shard size leave every number as it is."""
    (tmp_path / "mine.yaml").write_text("fit: {materials_per_job: 3}")
    targets = [f"results/samples/parity/{method}.h5" for method in ("hyperdiffusion", "vae-a", "copies")]
    options = {"overlays": (SMOKE, tmp_path / "mine.yaml")}
    first = subprocess.Popen(
        command(tmp_path, "--cores", "2", "--", *targets, **options),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    until = time.monotonic() + 900
    while not list(tmp_path.glob("results/neumerl/shards/*.h5")) and time.monotonic() < until:
        time.sleep(0.2)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    whole = {path: path.stat().st_mtime_ns for path in tmp_path.glob("results/*/*.h5")}
    assert {path.name for path in whole} == {"sources.h5", "augmerl.h5", "first.h5"}

    run(tmp_path, "--unlock", "--", *targets, **options)
    run(tmp_path, "--cores", "1", "--", *targets, **options)
    assert all(path.stat().st_mtime_ns == time_ for path, time_ in whole.items())
    ours, theirs = contents(tmp_path), contents(smoke)
    assert ours.keys() == {"neumerl.h5", "hyperdiffusion.h5", "vae-a.h5", "copies.h5"}
    for name in ours:
        np.testing.assert_array_equal(ours[name], theirs[name], err_msg=name)
