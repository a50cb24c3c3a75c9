"""Tables about the categories of reflectance: of each source, readings, overlap, agreement with names."""

import numpy as np
import pandas as pd

from neumat.brdf.categories import CATEGORIES, categorise, other_readings

# What a material is called where it should be in a category, as a regular expression over its name, type and family.
# No word says low- or mid-specular.
WORDS = {
    "diffuse": r"^(?!.*specular).*(?:fabric|felt|matte|diffuse|foam|rubber)",
    "metallic": r"\bmetal\b|metallic|silver|gold",
    "high-specular": r"specular-|chrome",
    "plastic": r"plastic",
    "mirror": r"chrome|specular-",
}
NAMES_COLUMNS = ["category", "words", "named", "in_category", "both", "precision", "recall", "unnamed", "missed"]
PAPER_BOUNDARIES = (100, 600)  # M3ashy, appendix D.4, 1/sr


def with_types(statistics, types):
    """Return the statistics of sources with their type and family after the `name`; "unknown" where `types`, of
    brdf.types.read_types, does not name them."""
    labels = types[["type", "family"]].reindex(statistics["name"]).fillna("unknown").reset_index(drop=True)
    return pd.concat([statistics[["name"]], labels, statistics.drop(columns="name")], axis=1)


def source_table(statistics, types, rules):
    """Return one row per source: name, type, family, a bool for each category, the statistics; see `with_types`."""
    table = with_types(statistics, types)
    return pd.concat([table.iloc[:, :3], categorise(statistics, rules), table.iloc[:, 3:]], axis=1)


def readings_table(sources, fields, rules):
    """Return what each reading of a rule changes: category, reading, and of the sources and of AugMERL how many
    materials are in it and how many change sides against the chosen reading.

    sources, fields: statistics with `name`, of the measured tables and of AugMERL's fields. The reading "field instead
    of measured table" is the chosen one on the sources' fields.
    """
    chosen = categorise(sources, rules), categorise(fields, rules)
    others = {name: [] for name in CATEGORIES}
    both = zip(other_readings(sources, rules), other_readings(fields, rules), strict=True)
    for (category, reading, of_sources), (_, _, of_fields) in both:
        others[category].append((reading, of_sources, of_fields))
    fitted = categorise(fields.set_index("name").loc[sources["name"]].reset_index(), rules)
    rows = []
    for category in CATEGORIES:
        mine, theirs = (table[category] for table in chosen)
        field = ("field instead of measured table", fitted[category], theirs)
        for reading, a, b in [("chosen", mine, theirs), *others[category], field]:
            rows.append((category, reading, a.sum(), (a != mine).sum(), b.sum(), (b != theirs).sum()))
    columns = ["category", "reading", "sources", "sources_changed", "augmerl", "augmerl_changed"]
    return pd.DataFrame(rows, columns=columns)


def overlap_table(sources, fields, rules):
    """Return how many materials of a row's category are in a column's: set (sources, augmerl), category, CATEGORIES."""
    tables = []
    for name, statistics in (("sources", sources), ("augmerl", fields)):
        member = categorise(statistics, rules).to_numpy(int)
        table = pd.DataFrame(member.T @ member, columns=CATEGORIES)
        table.insert(0, "category", CATEGORIES)
        table.insert(0, "set", name)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def names_table(table):
    """Return how the categories of `source_table` agree with names: category, words, named, in_category, both,
    precision (share of the category that is so named), recall (share of the so named in the category), and the names
    on one side only, `unnamed` and `missed`. Categories without WORDS, and WORDS that no source has, are left out.
    """
    text = table["name"] + " " + table["type"] + " " + table["family"]
    rows = []
    for category, words in WORDS.items():
        named, member = text.str.contains(words), table[category]
        both = (named & member).sum()
        if named.any():
            rows.append(
                {
                    "category": category,
                    "words": words,
                    "named": named.sum(),
                    "in_category": member.sum(),
                    "both": both,
                    "precision": both / member.sum() if member.any() else np.nan,
                    "recall": both / named.sum(),
                    "unnamed": " ".join(table["name"][member & ~named]),
                    "missed": " ".join(table["name"][named & ~member]),
                }
            )
    return pd.DataFrame(rows, columns=NAMES_COLUMNS)
