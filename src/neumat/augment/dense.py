"""AugMERL, dense: as many more base materials as wanted, beyond the 400 of the paper, and their values.

A base is a blend of up to three sources at any weights, of their reflectance or of its logarithm log(1 + f); then its
colours are mixed and its brightness is changed. No step creates energy: the logarithm is concave, so a blend of
logarithms lies below the blend of reflectances; the rows of the mixing matrix are convex; and brightness is bounded by
the parents' albedos.
"""

import numpy as np
import pandas as pd

from neumat.augment.manifest import held_out_sources, source_rows
from neumat.errors import NeumatError
from neumat.seeds import numpy_generator
from neumat.tables import read_table

PARENTS = ["parent_a", "parent_b", "parent_c"]
WEIGHTS = ["weight_a", "weight_b", "weight_c"]
MIXING = [f"mix_{row}{column}" for row in "rgb" for column in "rgb"]
RECIPE = ["base", *PARENTS, *WEIGHTS, "logarithmic", "brightness", *MIXING]
COLUMNS = [*RECIPE, "grouped"]
LARGEST_ALBEDO = 0.95  # of a base, in any channel and at any angle: room for what its fit adds


def draw_recipe(names, albedo, numbers, config, seed):
    """Return the bases of these `numbers` (n,), a DataFrame with the columns RECIPE; all parents are among `names`.

    names: sources; albedo: the largest directional albedo of each. config: the section `augment.dense`: parents (shares
    of bases with one, two and three parents), logarithmic (share of blends of log(1 + f)), brightness (the largest
    factor, drawn as often as its inverse), mixing (the largest share of mixed colours). A base depends on its number,
    the names and the config alone. One with fewer than three parents repeats the first one with weight 0.
    Raises NeumatError where there are fewer names than parents, and for albedos that are not those of the names.
    """
    shares = np.array(config["parents"][: len(names)], float)
    if not shares.sum() > 0:
        raise NeumatError("sources of the dense set", f"as many as bases have parents, {config['parents']}", len(names))
    albedo = np.asarray(albedo, float)
    if albedo.shape != (len(names),) or not (albedo > 0).all():
        raise NeumatError("albedos of the dense set", f"{len(names)} positive numbers", albedo)
    rows = []
    for number in numbers:
        generator = numpy_generator(seed, "dense", number)
        parents = generator.choice(len(shares), p=shares / shares.sum()) + 1
        chosen, weight = np.zeros(3, int), np.zeros(3)
        chosen[:parents] = generator.choice(len(names), parents, replace=False)
        chosen[parents:] = chosen[0]
        weight[:parents] = generator.dirichlet(np.ones(parents))
        logarithmic = int(generator.random() < config["logarithmic"])
        brightness = config["brightness"] ** generator.uniform(-1, 1)
        brightness = min(brightness, LARGEST_ALBEDO / (weight @ albedo[chosen]))
        share = config["mixing"] * generator.random()
        mixing = (1 - share) * np.eye(3) + share * generator.dirichlet(np.ones(3), 3)
        parts = [names[i] for i in chosen], weight, [logarithmic, brightness], mixing.ravel()
        rows.append([f"dense-{number:05d}", *(value for part in parts for value in part)])
    return pd.DataFrame(rows, columns=RECIPE)


def draw_dense(manifest, albedo, config, seed):
    """Return the `count` dense bases of the config's section `augment.dense`, a DataFrame with COLUMNS.

    manifest: of `draw_manifest`; albedo: of its sources, in their order. Each side of the grouped split has the share
    of the bases that it has of the sources, and no base has parents on both.
    """
    sources = source_rows(manifest)
    test = (sources["grouped"] == "test").to_numpy()
    first = config["count"] - round(test.mean() * config["count"])
    parts = []
    for side, members, numbers in (("train", ~test, range(first)), ("test", test, range(first, config["count"]))):
        names = list(sources["base"][members])
        parts.append(draw_recipe(names, np.asarray(albedo)[members], numbers, config, seed).assign(grouped=side))
    return pd.concat(parts, ignore_index=True)


def read_dense(path):
    """Return the dense bases written as TSV. Raises NeumatError for a file that holds none."""
    rows = read_table(path)
    if list(rows.columns) != COLUMNS:
        raise NeumatError(path, f"the columns {', '.join(COLUMNS)}", ", ".join(map(ascii, rows.columns)))
    numbers = rows[[*WEIGHTS, "logarithmic", "brightness", *MIXING]]
    if not all(pd.api.types.is_numeric_dtype(kind) for kind in numbers.dtypes) or not np.isfinite(numbers).all(
        axis=None
    ):
        raise NeumatError(path, "finite numbers in all columns but names and sides", "others")
    return rows


def dense_indices(rows, manifest, protocol):
    """Return the indices (n,) of the dense bases, DataFrame `rows`, that `protocol` trains on: those without a parent
    that it holds out.

    "parity" holds out single materials and no source, so it trains on all. Raises NeumatError for an unknown protocol.
    """
    held = rows[PARENTS].isin(held_out_sources(manifest, protocol)).any(axis=1)
    return np.flatnonzero(~held)


def dense_values(sources, rows, positions):
    """Return the values of the bases `rows`, of `draw_recipe`, at `positions` (m,) within `sources.entries`: (n, m, 3)
    float32, 1/sr.

    sources: of `read_sources`, which each parent is read from once. Raises NeumatError for parents that it lacks.
    """
    names, where = parents_of(rows, sources.names, sources.path)
    return mix(np.stack([sources.values(i, positions) for i in names]), where, rows)


def parents_of(rows, names, path):
    """Return (numbers (p,) of the parents of all bases `rows` within `names`, positions (n, 3) among them of each).

    path: of the store that holds the names, for the NeumatError where it lacks one.
    """
    number = {name: i for i, name in enumerate(names)}
    missing = sorted(set(rows[PARENTS].to_numpy().ravel()) - set(number))
    if missing:
        raise NeumatError(path, "the parents of the dense set", f"no {', '.join(missing)}")
    numbers, where = np.unique(rows[PARENTS].map(number.__getitem__).to_numpy(), return_inverse=True)
    return numbers, where.reshape(len(rows), len(PARENTS))


def mix(values, where, rows):
    """Return the values (n, m, 3) float32 of the bases `rows` from those of all parents, (p, m, 3) float32, 1/sr.

    where: (n, 3) positions of each base's parents among the p.
    """
    logarithms, weight, colours = np.log1p(values), rows[WEIGHTS].to_numpy(np.float32), colour_matrices(rows)
    found = np.empty((len(rows), *values.shape[1:]), np.float32)
    for k, logarithmic in enumerate(rows["logarithmic"]):
        used = weight[k] > 0
        terms = (logarithms if logarithmic else values)[where[k, used]]
        blend = np.tensordot(weight[k, used], terms, 1)
        np.matmul(np.expm1(blend) if logarithmic else blend, colours[k].T, out=found[k])
    return found


def colour_matrices(rows):
    """Return the matrices (n, 3, 3) float32 that change the colours and the brightness of the blends of `rows`."""
    mixing = rows[MIXING].to_numpy(np.float32).reshape(-1, 3, 3)
    return mixing * rows["brightness"].to_numpy(np.float32)[:, None, None]
