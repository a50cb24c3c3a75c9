"""The conditional model, from the stores."""

import torch
from safetensors import safe_open
from torch.nn.functional import normalize

from neumat.augment.manifest import read_manifest
from neumat.brdf.categories import CATEGORIES, categorise
from neumat.conditions.appearance import AppearanceRegression, rendered_appearance
from neumat.conditions.descriptions import encoded_descriptions
from neumat.conditions.encoders import encoder_of
from neumat.conditions.projection import Projection
from neumat.conditions.store import read_conditions
from neumat.fields.store import read_neumerl
from neumat.files import reading
from neumat.generative.conditional import ConditionalDiffusion, Tuning
from neumat.generative.dataset import training_indices
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.generative.orders import distinct
from neumat.tables import read_table

PROTOCOL = "grouped"
LANDMARKS = 1000  # captions kept in the checkpoint, to tell texts about materials from others


def read_projection(path):
    """Return the Projection that the rule `projection` wrote. Raises NeumatError for another or a damaged file."""
    with reading(path, "a projection of texts and pictures"), safe_open(path, "pt") as file:
        return Projection(file.metadata()["encoder"], {name: file.get_tensor(name) for name in file.keys()})


def training_conditions(conditions, projection, category, train):
    """Return {modality: tensor} of the materials `train` (n,), as ConditionalDiffusion.fit takes them.

    category (N, C), bool, of all materials.
    """
    return {
        "type": conditions.type[train],
        "category": torch.as_tensor(category[train]).float(),
        "text": projection.text(conditions.text[train]),
        "said": conditions.even_colours[train],
        "image": projection.image(conditions.image[train]),
    }


def landmarks(captions, count):
    """Return at most `count` of encoded captions (n, t) of length 1, each the one farthest from those before it, as
    int8: rows are to be normalised again. The cosine of a text to the nearest is off by some thousandths."""
    chosen, nearest = [0], captions @ captions[0]
    while len(chosen) < min(count, len(captions)):
        chosen.append(nearest.argmin().item())
        nearest = torch.maximum(nearest, captions @ captions[chosen[-1]])
    kept = captions[chosen]
    return (127 * kept / kept.abs().max()).round().to(torch.int8)


def for_requests(projection, captions, weights, images):
    """Return the tensors that a Synthesiser needs beside the networks: the Projection, captions (m, t) and what
    materials are called, as encoded, the training materials (n, 675), those that differ by the order of their channels
    once, with the mean of their embedded pictures, and the regression that predicts their rendered appearance from
    encoded pictures (n, a, i)."""
    told = AppearanceRegression.fit(images, rendered_appearance(weights)).state
    fields, positions, orders = distinct(weights)
    seen = projection.image(images).mean(1)
    embedded = seen.new_zeros(len(fields), seen.shape[1]).index_add_(0, positions, seen)
    return {
        **projection.state,
        **{f"appearance.{name}": value for name, value in told.items()},
        "captions": captions,
        "descriptions": encoded_descriptions(encoder_of(projection.encoder)),
        "fields": fields,
        "positions": positions.int(),
        "orders": orders.byte(),
        "embedded": normalize(embedded).half(),
    }


def tune(paths, protocol, tuning, rules, sampling, served, seed, progress, checkpoint):
    """Return the fitted ConditionalDiffusion, which carries what requests need, see `for_requests`, and the names that
    can be asked for.

    paths: neumerl, manifest, conditions, projection, statistics (of all fields), model (the unconditional one).
    protocol: whose training materials it learns. tuning, sampling: dicts. served: guidance {modality: scale},
    candidates and things, see Synthesiser and `things.packed`. rules: of the categories, see `categorise`.
    """
    fitted = read_neumerl(paths["neumerl"])
    train = training_indices(fitted, read_manifest(paths["manifest"]), protocol)
    conditions, projection = read_conditions(paths["conditions"]), read_projection(paths["projection"])
    category = categorise(read_table(paths["statistics"]), rules).to_numpy()
    base = HyperDiffusion.load(paths["model"])
    base.sampler, base.nfe = sampling["sampler"], sampling["nfe"]
    given = training_conditions(conditions, projection, category, train)
    known = (given["type"] > 0).any(0)  # a type of which all sources are held out can't be asked for
    given["type"] = given["type"][:, known]
    types = [name for name, there in zip(conditions.types, known.tolist(), strict=True) if there]
    weights = fitted.weights[torch.as_tensor(train)]
    notes = {"encoder": conditions.encoder, "types": types, "categories": list(CATEGORIES)} | served
    spread = normalize(conditions.text[train].flatten(0, 1).unique(dim=0))
    extra = for_requests(projection, landmarks(spread, LANDMARKS), weights, conditions.image[train])
    model = ConditionalDiffusion(base, Tuning(**tuning), notes, extra)
    return model.fit(weights, given, seed, progress, checkpoint)
