"""Chart 6: how near representations of a BTF come, against what they cost; and the table of relief."""

import re

import pandas as pd

from neumat.reporting.charts import frontier_chart
from neumat.tables import read_table

DEFAULT = "ours"
TITLES = {"bytes": "bytes", "ns": "ns a query, one core"}


def chart_table(paths):
    """Return the rows for the report of the tables of single fits: `setting`, a name, and `varied`, what it differs in.

    A setting is a representation, a hyperparameter of `ours` with its value, or the side of a smaller plane.
    """
    table = _reported(paths)
    plane = table["surface"].str.extract(r"@texels=(\d+)$")[0]
    setting, change = table["representation"].str.partition("@")[[0, 2]].T.values
    table["setting"] = [
        f"plane={side}" if isinstance(side, str) else changed or name
        for side, name, changed in zip(plane, setting, change, strict=True)
    ]
    table["varied"] = [name.partition("=")[0] if "=" in name else "representation" for name in table["setting"]]
    return table


def representations_chart(table, cost, path_stem):
    """Draw FLIP against the column `cost` of a `chart_table` into `path_stem`.png and .svg, the default marked."""
    frontier_chart(
        table,
        cost,
        "flip",
        "setting",
        DEFAULT,
        path_stem,
        group="varied",
        x_title=TITLES[cost],
        y_title="mean FLIP at held-out directions",
        title=f"Chart 6: {table['surface'].str.partition('@')[0].iloc[0]}",
    )


def relief_table(paths):
    """Return the rows for the report of fits of surfaces "name@relief=factor,...", with a column `relief`."""
    table = _reported(paths)
    table.insert(1, "relief", [float(re.search("relief=([0-9.]+)", name)[1]) for name in table["surface"]])
    for column in ("surface", "representation"):
        table[column] = table[column].str.partition("@")[0]
    return table


def _reported(paths):
    """Return the rows for the report of tables of `studies.btf_quality.quality`."""
    table = pd.concat([read_table(path) for path in paths], ignore_index=True)
    return table[table["pairs"] == "report"].reset_index(drop=True)
