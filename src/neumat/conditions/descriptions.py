"""What a material would be called, its colour and gloss in words, and how near that is to what a text says."""

import itertools

import numpy as np
import torch
from torch.nn.functional import normalize

from neumat.conditions.texts import GLOSS as GLOSS_WORDINGS
from neumat.metrics.words import COLOURS, GLOSS, colour_name, gloss_name

DESCRIPTIONS = tuple(itertools.product(COLOURS, GLOSS, ("material", "metal")))


def encoded_descriptions(encoder):
    """Return every one of DESCRIPTIONS, (d, t), as `encoder` reads it on average over the wordings of its gloss."""
    texts = [
        [f"{wording} {colour} {thing}" for wording in GLOSS_WORDINGS[gloss]] for colour, gloss, thing in DESCRIPTIONS
    ]
    features = encoder.encode_text(list(itertools.chain(*texts))).split([len(wordings) for wordings in texts])
    return torch.stack([wordings.mean(0) for wordings in features])


class Descriptions:
    """Every description there is; features (d, t): see `encoded_descriptions`.

    They are compared as the encoder gives them, less what all descriptions have in common: the projection into the
    common space forgets much of what it was not trained on.
    """

    def __init__(self, features):
        self.centre = features.mean(0)
        self.features = normalize(features - self.centre)

    def of(self, seen):
        """Return the encoded descriptions (n, t), of length 1, of rows of `metrics.appearance.appearance`."""
        things = np.where(seen["metallic"], "metal", "material")
        named = zip(colour_name(seen), gloss_name(seen), things, strict=True)
        return self.features[torch.tensor([DESCRIPTIONS.index(words) for words in named])]

    def centred(self, texts):
        """Return encoded texts (r, t) as descriptions are compared with them."""
        return normalize(texts - self.centre)
