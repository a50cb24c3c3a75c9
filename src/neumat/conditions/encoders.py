"""Pretrained encoders of texts and images behind one interface; their features are joined by `projection.py`.

An encoder has an `id`, which checkpoints carry, `encode_text(list of str) -> (n, t)` and `encode_image(uint8 sRGB
(n, H, W, 3)) -> (n, i)`, float32 tensors with rows of about unit length; `pieces(text) -> [(start, end, known)]`, the
word pieces in which it reads a text, and `longest`, how many of them it reads at most.
"""

import functools
import re

import torch
from torch.nn.functional import normalize

from neumat.conditions.minilm import minilm
from neumat.errors import NeumatError
from neumat.metrics import frechet

THUMBNAIL = 4  # pixels along each side
CLIP_SIZE = 224


class Packaged:
    """The encoders that come as Python packages: all-MiniLM-L6-v2 (384 numbers) for texts; for images the features
    of EfficientNet-Lite0 (1280), which see shapes and little colour, and a thumbnail's sRGB values (48), which see it.
    """

    id = "minilm-l6-v2+efficientnet-lite0-thumbnail4"

    @property
    def longest(self):
        return minilm().longest

    def pieces(self, text):
        """Return [(start, end, known)]; the vocabulary has no piece of what is not known."""
        return minilm().pieces(text)

    def encode_text(self, texts):
        """Return (n, 384). Raises NeumatError where the package is not installed."""
        return minilm().encode(texts)

    def encode_image(self, images):
        """Return (n, 1328). Raises NeumatError where the packages are not installed."""
        shapes = normalize(frechet.features(images))
        small = torch.cat([frechet.resized(part, THUMBNAIL) for part in images.split(256)])
        return torch.cat([shapes, (small.flatten(1) - 0.5) / THUMBNAIL], 1)


class OpenClip:
    """CLIP ViT-B/32 (Radford et al. 2021) by the package open_clip, which fetches the weights on first use."""

    id = "open-clip-vit-b-32-laion2b"
    longest = 75  # of a context of 77, with a mark at each end

    def pieces(self, text):
        """Return [(start, end, known)]: each word as often as it has pieces. All is known: the pieces are of bytes."""
        _, tokenise = _open_clip()
        words = [(match.span(), tokenise.encode(match[0])) for match in re.finditer(r"\S+", text)]
        return [(*span, True) for span, numbers in words for _ in numbers]

    def encode_text(self, texts):
        """Return (n, 512). Raises NeumatError where the package or its weights cannot be had."""
        network, tokenise = _open_clip()
        with torch.inference_mode():
            return torch.cat(
                [normalize(network.encode_text(tokenise(texts[k : k + 64]))) for k in range(0, len(texts), 64)]
            )

    def encode_image(self, images):
        """Return (n, 512). Raises NeumatError where the package or its weights cannot be had."""
        network, _ = _open_clip()
        mean, std = (torch.tensor(v)[:, None, None] for v in (network.visual.image_mean, network.visual.image_std))
        with torch.inference_mode():
            parts = [(frechet.resized(part, CLIP_SIZE) - mean) / std for part in images.split(64)]
            return torch.cat([normalize(network.encode_image(part)) for part in parts])


ENCODERS = {"packaged": Packaged, "open-clip": OpenClip}


def make_encoder(name):
    """Return the encoder of that name. Raises NeumatError for an unknown one."""
    if name not in ENCODERS:
        raise NeumatError("encoder", f"one of {', '.join(ENCODERS)}", name)
    return ENCODERS[name]()


def encoder_of(encoder_id):
    """Return the encoder whose id a checkpoint carries. Raises NeumatError for an unknown id."""
    for encoder in ENCODERS.values():
        if encoder.id == encoder_id:
            return encoder()
    raise NeumatError("encoder of the checkpoint", f"one of {', '.join(e.id for e in ENCODERS.values())}", encoder_id)


@functools.cache
def _open_clip():
    try:
        import open_clip

        network, _, _ = open_clip.create_model_and_transforms("ViT-B-32", pretrained="laion2b_s34b_b79k")
    except Exception as error:  # of the package, the network or the cache: all mean that there are no weights
        raise NeumatError("the CLIP encoder", "the package open_clip_torch and its weights", error) from error
    return network.eval(), open_clip.get_tokenizer("ViT-B-32")
