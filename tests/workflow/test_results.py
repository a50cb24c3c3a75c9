"""What a finished run leaves."""

import pandas as pd
from runner import run


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
