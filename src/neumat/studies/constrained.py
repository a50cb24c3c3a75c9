"""What constrained synthesis costs, and how well what it finds matches the category's measured distribution."""

import numpy as np
import pandas as pd
import torch

from neumat.augment.permutations import PERMUTATIONS
from neumat.brdf.categories import CATEGORIES, categorise
from neumat.errors import NeumatError
from neumat.fields.store import read_samples
from neumat.metrics.distances import between
from neumat.metrics.sets import one_nna
from neumat.seeds import numpy_generator

DISTANCE = "brdf_l1_log"
MEMBERS = 240  # of a category at most, drawn at random, with which samples are compared
# Of a file of constrained samples: what its table needs.
ATTRIBUTES = {"category": str, "way": str, "message": str, "seconds": float}
ATTRIBUTES |= dict.fromkeys(("wanted", "tried", "accepted", "invalid"), int)
DRAWS = 20  # of as many members as there are samples, over which 1-NNA is averaged


def read_found(path):
    """Return (weights (k, 675) tensor, attributes) of a file that constrained synthesis wrote.

    Raises NeumatError for another file.
    """
    weights, attributes = read_samples(path)
    for key, kinds in ATTRIBUTES.items():
        if not isinstance(attributes.get(key), kinds):
            raise NeumatError(path, f"samples of a category, with the attribute {key}", repr(attributes.get(key)))
    return weights, attributes


def constrained_table(paths, protocol, statistics, rules, step):
    """Return one row per file of constrained samples, by category and way.

    paths: files, see `read_found`. protocol: see `neumat.studies.protocols`; statistics: of its 2400 materials;
    rules: see `categorise`; step: every how manieth metric entry counts in distances.

    Columns: category, way, wanted, found, tried, accepted, invalid, acceptance (accepted / tried), seconds,
    seconds_per_accepted (inf where none was), training_share of the training materials in the category; then, over the
    mean |log(1 + f) - log(1 + f')|, one_nna in percent (50 is best) against as many members of the category among
    the training materials, and the median distances from a sample to its nearest member, nearest_member, and from a
    member to the nearest one of another base material, member_to_member; NaN where there is nothing to compare.
    """
    categories = categorise(statistics, rules)
    rows = []
    for path in paths:
        weights, a = read_found(path)
        member = categories[a["category"]].to_numpy()[protocol.train]
        row = {key: a[key] for key in ("category", "way", "wanted")} | {"found": len(weights)}
        row |= {key: a[key] for key in ("tried", "accepted", "invalid")}
        row["acceptance"] = a["accepted"] / a["tried"]
        row["seconds"] = a["seconds"]
        row["seconds_per_accepted"] = a["seconds"] / a["accepted"] if a["accepted"] else np.inf
        row["training_share"] = member.mean()
        row |= _match(weights, protocol.train[member], protocol, step, a["category"])
        rows.append(row)
    table = pd.DataFrame(rows)
    order = table["category"].map(CATEGORIES.index)
    return table.iloc[np.lexsort((table["way"], order))].reset_index(drop=True)


def _match(weights, members, protocol, step, category):
    """Return the columns of `constrained_table` that compare samples with members (indices of materials)."""
    result = dict.fromkeys(("one_nna", "nearest_member", "member_to_member"), np.nan)
    generator = numpy_generator(protocol.seed, "members of a category", category)
    members = np.sort(generator.permutation(members)[:MEMBERS])
    base = members // len(PERMUTATIONS)
    if len(np.unique(base)) < 2:
        return result
    reference = protocol.materials(members, pictures=False, step=step)
    own = between(DISTANCE, reference, reference)
    related = torch.from_numpy(base[:, None] == base)
    result["member_to_member"] = own.masked_fill(related, torch.inf).amin(1).median().item()
    if len(weights) < 1:
        return result
    samples = protocol.fields(weights, pictures=False, step=step)
    table = between(DISTANCE, reference, samples)
    result["nearest_member"] = table.amin(0).median().item()
    size = min(len(samples), len(members))
    if size > 1:
        scores = []
        within = between(DISTANCE, samples, samples)
        for _ in range(DRAWS):
            r, s = (torch.from_numpy(generator.permutation(k)[:size]) for k in (len(members), len(samples)))
            scores.append(one_nna(table[r][:, s], own[r][:, r], within[s][:, s]))
        result["one_nna"] = 100 * np.mean(scores)
    return result
