"""The conditions of every material: its types, captions and pictures, the last two encoded, in one store."""

import json
from dataclasses import dataclass

import h5py
import numpy as np
import pandas as pd
import torch

from neumat.augment.manifest import read_manifest
from neumat.augment.permutations import PERMUTATIONS, channel_order
from neumat.brdf.types import read_types, type_names, type_rows
from neumat.conditions.encoders import make_encoder
from neumat.conditions.photos import SPHERE, augmented, lighting
from neumat.conditions.prompts import read_prompts
from neumat.conditions.texts import captions, thing_of
from neumat.conditions.things import known_things, likenesses, read_things
from neumat.errors import NeumatError
from neumat.fields.store import read_neumerl
from neumat.files import atomic_path, read_store, reading
from neumat.metrics.appearance import appearance
from neumat.metrics.words import colour_name, gloss_name
from neumat.render.sphere import FrozenSphere, radiance_fields

SCHEMA = 1
FACTS = ("name", "thing", "family", "colour", "gloss")
MEMBERS = {
    "type": ("numbers", ("n", "types")),
    "captions": ("text", ("n", "captions")),
    "text": ("numbers", ("n", "captions", "t")),
    "image": ("numbers", ("n", "pictures", "i")),
    **{f"facts/{name}": ("text", ("n",)) for name in FACTS},
}


@dataclass(frozen=True)
class Conditions:
    """The store's content: n materials in the manifest's order.

    type (n, T) float32, see `type_rows`; types: the T names; facts: DataFrame with name, colour, gloss, thing, family;
    captions: a list of p texts each; text (n, p, t) and image (n, a, i), float32, by the encoder of that id.
    """

    encoder: str
    types: list
    type: torch.Tensor
    facts: pd.DataFrame
    captions: list
    text: torch.Tensor
    image: torch.Tensor

    @property
    def even_colours(self):
        """Weights (n,), float64, by which materials are drawn so that every colour comes up equally often: there are
        25 times as many green ones as orange ones, and people ask for both."""
        colour = self.facts["colour"]
        return torch.from_numpy(1 / colour.map(colour.value_counts()).to_numpy(float))


def make_conditions(neumerl, manifest, types, prompts, things, config, seed, progress=iter):
    """Return the Conditions of all materials. neumerl, manifest, types, prompts, things: paths. No caption names a
    thing that is held out, see `things.held_out`.

    config: encoder, captions and pictures (how many of each a material), lightings.
    """
    rows, table = read_manifest(manifest), read_types(types)
    weights = read_neumerl(neumerl).weights
    encoder = make_encoder(config["encoder"])
    facts = pd.DataFrame([thing_of(row, table) for row in rows.itertuples()], columns=["thing", "family"])
    facts.insert(0, "name", rows["name"])
    seen = appearance(weights)
    facts["colour"], facts["gloss"] = colour_name(seen), gloss_name(seen)

    images = []
    for k in progress(range(config["pictures"])):
        linear = _pictures(weights, lighting(k % config["lightings"]))
        images.append(encoder.encode_image(augmented(linear, seed, k)))

    asked = read_prompts(prompts, table["family"].unique())["prompt"]
    said = captions(facts, config["captions"], asked, seed, likenesses(seen, known_things(read_things(things), True)))
    distinct = sorted({text for texts in said for text in texts})
    number = {text: i for i, text in enumerate(distinct)}
    encoded = encoder.encode_text(distinct)
    text = encoded[torch.tensor([[number[text] for text in texts] for texts in said])]
    known = torch.from_numpy(type_rows(rows, table))
    return Conditions(encoder.id, type_names(rows, table), known, facts, said, text, torch.stack(images, 1))


def _pictures(weights, environment):
    """Return linear pictures (n, S, S, 3) of weights (n, 675), six permutations of each base.

    The lights are grey, so a permuted material's picture is the permuted picture.
    """
    bases = radiance_fields(FrozenSphere(*SPHERE, environment=environment), weights[:: len(PERMUTATIONS)])
    orders = [channel_order(permutation) for permutation in PERMUTATIONS]
    return torch.stack([bases[..., list(order)] for order in orders], 1).flatten(0, 1)


def write_conditions(path, conditions):
    """Write the store; embeddings as float16."""
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file["type"] = conditions.type.numpy()
        file["captions"] = np.array(conditions.captions, dtype=object).astype(h5py.string_dtype())
        for name in ("text", "image"):
            file[name] = getattr(conditions, name).numpy().astype(np.float16)
        for name, column in conditions.facts.items():
            file[f"facts/{name}"] = column.to_numpy(object).astype(h5py.string_dtype())
        file.attrs.update(schema_version=SCHEMA, encoder=conditions.encoder, types=json.dumps(conditions.types))


def read_conditions(path):
    """Return the Conditions in `path`. Raises NeumatError for another file or schema version."""
    what = "a store of conditions"
    arrays, attributes = read_store(path, what, MEMBERS, SCHEMA)
    with reading(path, what):
        encoder, types = attributes["encoder"], json.loads(attributes["types"])
    if not (isinstance(encoder, str) and isinstance(types, list) and len(types) == arrays["type"].shape[1]):
        raise NeumatError(path, f"an encoder and {arrays['type'].shape[1]} types in its attributes", attributes)
    return Conditions(
        encoder=encoder,
        types=types,
        type=torch.from_numpy(arrays["type"]).float(),
        facts=pd.DataFrame({name: arrays[f"facts/{name}"] for name in FACTS}),
        captions=arrays["captions"].tolist(),
        text=torch.from_numpy(arrays["text"]).float(),
        image=torch.from_numpy(arrays["image"]).float(),
    )
