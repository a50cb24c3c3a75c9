import numpy as np
import pandas as pd
import pytest

from neumat.errors import NeumatError
from neumat.reporting.run_table import covered, run_table
from neumat.reporting.tables import LABELS, published, table2, table2_markdown


@pytest.fixture
def score_files(tmp_path):
    def write(protocol, method, level):
        rng = np.random.default_rng(0)
        rows = []
        for draw in range(10):
            for metric, distance in [("mmd", "rmse"), ("cov", "rmse"), ("one_nna", "rmse"), ("one_nna", "msl")]:
                rows.append((method, protocol, draw, metric, distance, level + rng.normal(), 120, 120))
            rows.append((method, protocol, draw, "nonfinite", "none", float(level == 90), 120, 120))
            rows.append((method, protocol, draw, "KID-X", "features", 0.1, 120, 120))
        columns = ["method", "protocol", "draw", "metric", "distance", "value", "n_ref", "n_samples"]
        path = tmp_path / f"{protocol}-{method}.csv"
        pd.DataFrame(rows, columns=columns).to_csv(path, index=False)
        return path

    methods = {"vae-a": 90, "training-set": 50, "hyperdiffusion": 60, "mine": 70}
    return [write(p, m, level) for p in ("parity", "grouped") for m, level in methods.items()]


def test_mean_and_interval_over_draws(score_files):
    table = table2(score_files)
    assert list(table) == ["method", "protocol", "metric", "distance", "value", "low", "high", "n_ref", "n_samples"]
    row = table[(table.method == "hyperdiffusion") & (table.metric == "mmd")].iloc[0]
    draws = pd.read_csv(score_files[2]).query("metric == 'mmd'").value
    assert row.value == pytest.approx(draws.mean())
    # A bootstrap interval of a mean of 10 is about the normal one, less the sqrt(9 / 10) of its biased variance.
    half = 1.96 * draws.std() * (9 / 10) ** 0.5 / 10**0.5
    assert row.high - row.low == pytest.approx(2 * half, rel=0.15)
    assert row.low < row.value < row.high
    pd.testing.assert_frame_equal(table, table2(score_files))
    # A row's interval depends on no other row.
    alone = table2(score_files[:1])
    pd.testing.assert_frame_equal(alone, table.iloc[: len(alone)])


def test_folds_become_one_protocol_whose_interval_holds_their_spread(tmp_path):
    columns = ["method", "protocol", "draw", "metric", "distance", "value", "n_ref", "n_samples"]
    levels, paths = [50, 60, 70, 80, 90], []
    for k, level in enumerate(levels):
        rows = [("m", f"fold{k}", draw, "mmd", "rmse", level + draw / 10, 118 + k, 120) for draw in range(3)]
        paths.append(tmp_path / f"{k}.csv")
        pd.DataFrame(rows, columns=columns).to_csv(paths[-1], index=False)
    row = table2(paths).iloc[0]
    assert len(table2(paths)) == 1 and row.protocol == "generalisation"
    assert row.value == pytest.approx(70.1) and (row.n_ref, row.n_samples) == ("118 to 122", "120")
    # The draws of a fold agree, so the interval is that of a mean of five levels.
    assert row.high - row.low == pytest.approx(2 * 1.96 * np.std(levels) / 5**0.5, rel=0.2)
    assert "118 to 122 held-out against 120 samples; mean over folds and draws" in table2_markdown(table2(paths))


def test_infinite_draws_stay_infinite(score_files):
    scores = pd.read_csv(score_files[0])
    scores.loc[scores.metric == "mmd", "value"] = np.inf
    scores.to_csv(score_files[0], index=False)
    row = table2(score_files[:1]).query("metric == 'mmd'").iloc[0]
    assert row.value == row.low == row.high == np.inf


def test_markdown_puts_published_figures_beside_parity_only(score_files):
    text = table2_markdown(table2(score_files))
    parity, grouped = text.split("## grouped")
    cell = next(line for line in parity.splitlines() if line.startswith("| hyperdiffusion") and "(60.0)" in line)
    assert cell.count("|") == 4  # the method, rmse with the published figure, msl without one
    assert "(60.0)" not in grouped and "M3ashy's Table 2" not in grouped
    rows = [line.split("|")[1].strip() for line in parity.splitlines() if line.startswith("| ")]
    assert rows[1:5] == ["training set", "hyperdiffusion (ours)", "VAE-A", "mine"]
    assert "VAE-A: 1 samples a draw were not finite." in parity
    assert "KID-X" in parity
    assert "FID" in parity and "FID" not in grouped


def test_the_published_fid_stands_beside_the_same_features(score_files):
    scores = pd.read_csv(score_files[2]).replace({"metric": {"KID-X": "Frechet-Inception64"}})
    scores.to_csv(score_files[2], index=False)
    text = table2_markdown(table2(score_files[:4]))
    assert "| 0.1 [0.1, 0.1] (0.44) |" in text and "Nor is FID" not in text


def test_distances_with_the_same_draws_have_the_same_interval(score_files):
    scores = pd.read_csv(score_files[2])
    psnr = scores[(scores.metric == "one_nna") & (scores.distance == "rmse")].assign(distance="neg_psnr")
    pd.concat([scores, psnr]).to_csv(score_files[2], index=False)
    rows = table2(score_files[2:3]).query("metric == 'one_nna'").set_index("distance")[["value", "low", "high"]]
    assert rows.loc["rmse"].equals(rows.loc["neg_psnr"]) and rows.loc["rmse", "low"] < rows.loc["rmse", "high"]
    assert "PSNR is a function of RMSE" in table2_markdown(table2(score_files[:1]))


def test_published_figures():
    facts = published()
    assert len(facts) == 7 * 13 and set(facts.method) <= set(LABELS)
    value = facts.set_index(["method", "metric", "distance"]).value
    assert value["hyperdiffusion", "one_nna", "brdf_l1"] == 80
    assert value["training-set", "mmd", "rmse"] == 0.0754
    assert value["vae-a", "mmd", "neg_ssim"] == -0.268
    assert value["merl100", "cov", "neg_ssim"] == 22.5
    assert value["hyperdiffusion", "Frechet-Inception64", "features"] == 0.44


HEADER = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"


def test_run_table(tmp_path):
    (tmp_path / "fit").mkdir()
    (tmp_path / "sources.tsv").write_text(HEADER + "2.5\t0:00:02\t100.5\t1\t1\t1\t0\t0\t90\t2.0\n")
    (tmp_path / "fit" / "1-of-2.tsv").write_text(HEADER + "10\t0:00:10\t300\t1\t1\t1\t0\t0\t90\t9.5\n")
    (tmp_path / "fit" / "2-of-2.tsv").write_text(HEADER + "0.1\t0:00:00\t-\t-\t-\t-\t-\t-\t-\tNA\n")
    table = run_table(tmp_path, tmp_path / "logs").set_index(["stage", "job"])
    where = table.pop("ended"), table.pop("machine")
    assert table.loc[("sources", "sources"), "wall_s"] == 2.5
    assert table.loc[("fit", "2-of-2")].isna().tolist() == [False, True, True]
    assert table.loc[("fit", "total")].tolist() == [10.1, 9.5, 300]
    assert table.loc[("run", "total")].tolist() == [12.6, 11.5, 300]
    assert ("sources", "total") not in table.index
    # All three files end at the same moment, so the longest job covers the others.
    assert table.loc[("run", "elapsed"), "wall_s"] == pytest.approx(10, abs=0.5)
    # The day and the machine are of the run and not of its jobs, nor of whoever reads the table later.
    assert [column.notna().sum() for column in where] == [1, 1]
    assert "cores of" in where[1]["run", "elapsed"]


def test_run_table_takes_cpu_time_from_a_log_that_ends_with_it(tmp_path):
    for name, log in (("a", "12:00:00 a: 51.25 s of CPU time\n"), ("b", "12:00:00 b: 1.0 s of CPU time\nfailed\n")):
        (tmp_path / f"{name}.tsv").write_text(HEADER + "60\t0:01:00\t300\t1\t1\t1\t0\t0\t90\t43\n")
        (tmp_path / f"{name}.log").write_text(log)
    table = run_table(tmp_path, tmp_path).set_index("job")
    assert table.loc[["a", "b"], "cpu_s"].tolist() == [51.25, 43]


def test_covered_counts_overlaps_once_and_pauses_not_at_all():
    starts, ends = np.array([5.0, 0.0, 1.0, 20.0]), np.array([8.0, 4.0, 2.0, 21.0])
    assert covered(starts, ends) == 4 + 3 + 1
    assert covered(np.array([0.0, 3.0]), np.array([4.0, 9.0])) == 9


def test_run_table_refuses_other_files(tmp_path):
    with pytest.raises(NeumatError, match="benchmark"):
        run_table(tmp_path, tmp_path)
    (tmp_path / "a.tsv").write_text("name\tvalue\n")
    with pytest.raises(NeumatError, match=r"a\.tsv"):
        run_table(tmp_path, tmp_path)
