import pandas as pd

from neumat.studies.requests import by_type


def accuracies(**top1):
    count = len(top1)
    return pd.DataFrame(
        {"type": [*top1], "family": ["metal"] * count, "sources": range(1, count + 1), "judged": [20] * count}
        | {"top1": top1.values(), "top3": [0.5] * count, "family_accuracy": [1.0] * count}
    )


def test_types_of_which_few_answers_are_right_are_counted():
    table = by_type(
        accuracies(steel=0.3, brass=0.35, chrome=0.0, felt=1.0), accuracies(steel=0, brass=0, chrome=0, felt=1)
    )
    assert table["type"].tolist() == ["steel", "brass", "chrome", "felt", "all types"]
    assert table["unmet"].tolist() == [1, 0, 1, 0, 2]
    assert table["right"].tolist() == [0.3, 0.35, 0.0, 1.0, (0.3 + 0.35 + 1) / 4]
    assert table["top1"].tolist() == [0, 0, 0, 1, 0.25]
    assert table["sources"].tolist() == [1, 2, 3, 4, 10] and table["judged"].tolist()[-1] == 80
    assert table["family"].tolist()[-1] == ""
