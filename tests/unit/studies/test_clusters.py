import pandas as pd
import pytest

from neumat.errors import NeumatError
from neumat.studies.clusters import cluster, kmeans_table


def test_clusters_by_hand():
    labels, boundaries = cluster([120, 1, 60, 2, 61, 119], logarithmic=False)
    assert labels.tolist() == [2, 0, 1, 0, 1, 2] and boundaries == pytest.approx([31, 90])
    labels, boundaries = cluster([100, 1, 10, 1, 10, 100], logarithmic=True)
    assert labels.tolist() == [2, 0, 1, 0, 1, 2] and boundaries == pytest.approx([10**0.5, 10**1.5])
    with pytest.raises(NeumatError, match="at least 3 different values; found 2"):
        cluster([1, 1, 2], logarithmic=False)


def test_kmeans_table_has_both_scales():
    statistics = pd.DataFrame(
        {f"{quantity}_{c}": [1.0, 9.0, 80.0, 700.0] for quantity in ("mean", "maximum") for c in "rgb"}
    ).assign(inner_maximum=[1.0, 9.0, 80.0, 700.0])
    table = kmeans_table(statistics)
    assert (table["boundary_1"] < table["boundary_2"]).all()
    assert (table[["low", "middle", "high"]].sum(axis=1) == 4).all()
    assert set(table["paper_1"].dropna()) == {100}
