"""AugMERL's list of materials: who descends from whom, and which side of which split each lies on."""

import numpy as np
import pandas as pd

from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.names import check_names
from neumat.errors import NeumatError
from neumat.seeds import numpy_generator
from neumat.tables import read_table

COLUMNS = ["index", "name", "base", "parent_a", "parent_b", "weight", "grouped", "fold", "permutation", "random"]
FOLDS = 5  # of the generalisation protocol; with fewer sources, one of each source


def draw_manifest(names, config, seed):
    """Return the manifest, a DataFrame of (N + blends) * 6 rows; index = base * 6 + permutation.

    names: N source materials. config: the section `augment`. Columns: index, name, base, parent_a, parent_b, weight
    (of parent_a), permutation, grouped and random (train or test), fold (of the parents; -1 where they differ).
    Pairs are drawn within a side of the grouped split, so no blend crosses it; the random split is the released
    code's, over all materials without regard to descent. Raises NeumatError for fewer than four names, for names
    that a material may not have and where a side of the grouped split has fewer than two sources.
    """
    n, blends = len(names), config["blends"]
    if n < 4:
        raise NeumatError("sources", "at least 4 materials to split and blend", n)
    check_names(names, "sources")
    order = numpy_generator(seed, "held-out sources").permutation(n)
    held = max(2, round(config["held_out"] * n))
    if held > n - 2:
        raise NeumatError("augment.held_out", f"a share that leaves 2 of {n} sources to train on", config["held_out"])
    sides = {"test": order[:held], "train": order[held:]}
    fold = np.empty(n, int)
    fold[numpy_generator(seed, "folds").permutation(n)] = np.arange(n) % fold_count(n)

    rows = [(name, name, name, 1.0, "test" if i in sides["test"] else "train", fold[i]) for i, name in enumerate(names)]
    generator = numpy_generator(seed, "blends")
    held_blends = round(config["held_out"] * blends)
    for k in range(blends):
        side = "test" if k < held_blends else "train"
        a, b = generator.choice(sides[side], 2, replace=False)
        weight = generator.uniform(*config["weight_range"])
        rows.append((f"blend-{k:03d}", names[a], names[b], weight, side, fold[a] if fold[a] == fold[b] else -1))

    bases = pd.DataFrame(rows, columns=["base", "parent_a", "parent_b", "weight", "grouped", "fold"])
    manifest = bases.loc[bases.index.repeat(len(PERMUTATIONS))].reset_index(drop=True)
    manifest["permutation"] = list(PERMUTATIONS) * len(bases)
    plain = manifest["permutation"] == "rgb"
    manifest.insert(0, "name", manifest["base"].where(plain, manifest["base"] + "@" + manifest["permutation"]))
    manifest.insert(0, "index", manifest.index)
    test = numpy_generator(seed, "random split").permutation(len(manifest))[: round(config["held_out"] * len(manifest))]
    manifest["random"] = np.where(manifest["index"].isin(test), "test", "train")
    return manifest


def fold_count(n):
    """Return how many folds the generalisation protocol has with n sources."""
    return min(FOLDS, n)


def read_manifest(path):
    """Return the manifest written as TSV, every name as it was. Raises NeumatError for a file that is none."""
    rows = read_table(path)
    if list(rows.columns) != COLUMNS:
        raise NeumatError(path, f"the columns {', '.join(COLUMNS)}", ", ".join(map(ascii, rows.columns)))
    for column in ("index", "fold", "weight"):
        if not pd.api.types.is_numeric_dtype(rows[column]) or not np.isfinite(rows[column]).all():
            raise NeumatError(path, f"numbers in the column {column}", "others")
    in_order = rows["index"].tolist() == list(range(len(rows))) and len(rows) % len(PERMUTATIONS) == 0
    if not in_order or rows["permutation"].tolist() != list(PERMUTATIONS) * (len(rows) // len(PERMUTATIONS)):
        raise NeumatError(path, "every base material in six permutations, in order", "others")
    if not len(rows) or not rows[["grouped", "random"]].isin(["train", "test"]).all(axis=None):
        raise NeumatError(path, "materials on the sides train and test", "none or other sides")
    return rows


def source_rows(manifest):
    """Return the rows of the manifest that are the sources as measured, in order."""
    plain = manifest["permutation"] == PERMUTATIONS[0]
    return manifest[plain & (manifest["base"] == manifest["parent_a"])]


def protocol_indices(manifest, protocol):
    """Return (train, reference), indices of the materials that `protocol` trains on and compares with.

    "parity": the random split. "grouped": the split by source material. "fold0", "fold1", ...: reference = the
    fold's source materials in all permutations, train = everything that has no parent among them. "everything": train =
    all, and none to compare with: what is trained on it has no figures of its own.
    Raises NeumatError for any other protocol.
    """
    held = held_out_sources(manifest, protocol)
    if protocol == "everything":
        return np.arange(len(manifest)), np.arange(0)
    if protocol in ("parity", "grouped"):
        test = (manifest["random" if protocol == "parity" else "grouped"] == "test").to_numpy()
        return np.flatnonzero(~test), np.flatnonzero(test)
    related = manifest[["parent_a", "parent_b"]].isin(held).any(axis=1)
    return np.flatnonzero(~related), np.flatnonzero(manifest["base"].isin(held))


def held_out_sources(manifest, protocol):
    """Return the set of names of the sources that `protocol` trains on no relative of; empty for "everything", and for
    "parity", which holds materials out without regard to descent.

    Raises NeumatError for an unknown protocol.
    """
    sources = source_rows(manifest)
    folds = [f"fold{k}" for k in sorted(set(sources["fold"]))]
    if protocol in ("parity", "everything"):
        return set()
    if protocol == "grouped":
        return set(sources["base"][sources["grouped"] == "test"])
    if protocol not in folds:
        raise NeumatError("protocol", f"parity, grouped, everything or one of {', '.join(folds)}", repr(protocol))
    return set(sources["base"][sources["fold"] == folds.index(protocol)])
