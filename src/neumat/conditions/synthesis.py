"""New materials on demand: from a type, a text, an image or a category, or several of them at once."""

import functools
import logging

import torch

from neumat.conditions.descriptions import Descriptions
from neumat.conditions.encoders import encoder_of
from neumat.conditions.photos import check_picture, read_photo
from neumat.conditions.projection import Projection
from neumat.conditions.store import AZIMUTHS, RINGS, SIZE
from neumat.conditions.variety import most_different
from neumat.errors import NeumatError
from neumat.generative.conditional import ConditionalDiffusion
from neumat.render.sphere import FrozenSphere, render_fields

FARTHEST = 0.5  # cosine to the nearest training caption, below which a text is not about materials
CANDIDATES = 16
GUIDANCE = {"type": 2.0, "category": 0.0, "text": 2.0, "image": 0.0}
# One in so many candidates is a good answer, of which the most different are served: a text leaves more open than a
# picture does.
CHOOSY = {"text": 4, "image": 8}
EDGE = 6  # a share of 1 / EDGE at each side of a picture is left out: the rest shows nothing but the sphere
WORDS_READ = 128  # of a text; encoders read no further


class Synthesiser:
    """A conditional model with the encoders that its requests need.

    Attributes: `types`, `categories`: the names that can be asked for. `model`: the ConditionalDiffusion.
    """

    def __init__(self, model):
        self.model = model
        self.types, self.categories = model.notes["types"], model.notes["categories"]
        extra = dict(model.extra)
        self.captions = extra.pop("captions")
        self.projection = Projection(model.notes["encoder"], extra)
        self.encoder = encoder_of(model.notes["encoder"])
        self.camera = FrozenSphere(SIZE, RINGS, AZIMUTHS)

    @functools.cached_property
    def descriptions(self):
        """The Descriptions, encoded where a text first needs them."""
        return Descriptions(self.encoder)

    @classmethod
    def load(cls, path):
        """Read the checkpoint that the rule `tune` wrote. Raises NeumatError for another file."""
        return cls(ConditionalDiffusion.load(path))

    def synthesise(self, n, seed, guidance=None, candidates=CANDIDATES, **request):
        """Return (weights (n, 675) of valid BRDFs, how many were drawn for them).

        guidance: the scale, or {modality: scale}, see `scale`; None for GUIDANCE. candidates: drawn for each of the n
        where a text or an image is given, see `best`. request: see `request`.
        Raises NeumatError for a request that cannot be met.
        """
        if candidates < 1:
            raise NeumatError("candidates", "at least 1", candidates)
        embedded = self.request(**request)
        texts = self.encoder.encode_text([request["text"]]) if "text" in embedded else None
        many = n * candidates if CHOOSY.keys() & embedded.keys() else n
        weights, drawn = self.model.sample(
            many, seed, embedded, scale(GUIDANCE if guidance is None else guidance, embedded)
        )
        return self.best(weights[None], embedded, n, texts)[0], drawn

    def best(self, weights, request, n, texts=None):
        """Return n (r, n, 675) of the candidates (r, m, 675) of each of r requests: of those that answer it best (see
        CHOOSY), the ones that differ most from each other. Where neither a text nor an image was given, the first n.

        A candidate's answer is the better, the nearer its picture comes to text and image, {modality: rows (r, size)},
        in the common space, and its description to `texts` (r, t), as encoded.
        """
        wanted = [name for name in CHOOSY if name in request]
        if not wanted or weights.shape[1] == n:
            return weights[:, :n]
        fields = weights.flatten(0, 1)
        edge = self.camera.size // EDGE
        seen = self.images(render_fields(self.camera, fields)[:, edge:-edge, edge:-edge]).view(*weights.shape[:2], -1)
        score = sum((seen * request[name][:, None]).sum(2) for name in wanted)
        if texts is not None:
            score = score + self.descriptions.match(weights, texts)
        rows = torch.arange(len(weights))[:, None]
        shortlist = max(n, weights.shape[1] // max(CHOOSY[name] for name in wanted))
        best = weights[rows, score.topk(shortlist).indices]
        return best[rows, most_different(best, n)]

    def request(self, type=None, category=None, text=None, image=None):
        """Return {modality: row (1, size)} for what is not None.

        type, category: a name; text: words; image: the path of an image file, or a picture uint8 (H, W, 3). Raises
        NeumatError for an unknown name, no text or an image that shows nothing; warns of texts that are far
        from all that the model was trained on, or too long.
        """
        rows = {}
        if type is not None:
            rows["type"] = _one_hot("type", type, self.types)
        if category is not None:
            rows["category"] = _one_hot("category", category, self.categories)
        if text is not None:
            features = self.encoded([text])
            rows["text"] = self.projection.text(features)
        if image is not None:
            picture = image if isinstance(image, torch.Tensor) else read_photo(image)
            check_picture("image", picture)
            rows["image"] = self.images(picture[None])
        return rows

    def encoded(self, texts):
        """Return texts as encoded, (n, t). Raises NeumatError for an empty one and for what is no text."""
        for text in texts:
            if not isinstance(text, str):
                raise NeumatError("text", "words", repr(text))
            if not text.strip():
                raise NeumatError("text", "words", "an empty text")
            if any("\ud800" <= letter <= "\udfff" for letter in text):  # as Python reads bytes that are not UTF-8
                raise NeumatError("text", "Unicode", f"{text[:40]!r}")
            if len(text.split()) > WORDS_READ:
                logging.warning("text: only its first %d words are read, of %d", WORDS_READ, len(text.split()))
        features = self.encoder.encode_text([" ".join(text.split()[:WORDS_READ]) for text in texts])
        for text, nearest in zip(texts, (features @ self.captions.float().T).amax(1).tolist(), strict=True):
            if nearest < FARTHEST:
                logging.warning("text %.40r: unlike any description of a material (similarity %.2f)", text, nearest)
        return features

    def images(self, pictures):
        """Return the embeddings (n, size) of uint8 sRGB pictures (n, H, W, 3)."""
        return self.projection.image(self.encoder.encode_image(pictures))


def scale(guidance, request):
    """Return the guidance scale of a request: `guidance`, or of {modality: scale} the least of what is asked for, since
    what is exaggerated for one modality is lost for another."""
    return min((guidance[name] for name in request), default=0.0) if isinstance(guidance, dict) else guidance


def _one_hot(kind, name, names):
    if name not in names:
        raise NeumatError(kind, f"one of {', '.join(names)}", repr(name))
    return torch.eye(len(names))[names.index(name)][None]
