"""New materials on demand: from a type, a text, an image or a category, or several of them at once."""

import functools

import torch
from torch.nn.functional import normalize

from neumat.conditions.appearance import AppearanceRegression, rendered_appearance
from neumat.conditions.choice import COLOUR, RANGES, Seen, choose, coloured, colourless, fit, only_shown
from neumat.conditions.colour_names import read_colour
from neumat.conditions.colouring import as_shown, tell_missed, within
from neumat.conditions.descriptions import Descriptions
from neumat.conditions.encoders import encoder_of
from neumat.conditions.known import Known
from neumat.conditions.packaged import packaged_model
from neumat.conditions.photos import SPHERE, check_picture, read_photo
from neumat.conditions.projection import Projection
from neumat.conditions.ranges import colour_row, row, seen
from neumat.conditions.text_input import check_text, comment, readable_text
from neumat.conditions.things import unpacked
from neumat.conditions.wanted import Vocabulary
from neumat.errors import NeumatError
from neumat.fields.layout import SIZE as FIELD
from neumat.generative.anew import served
from neumat.generative.conditional import ConditionalDiffusion
from neumat.generative.orders import ORDERS, distinct, reorder
from neumat.metrics.appearance import appearance
from neumat.render.sphere import FrozenSphere, render_fields
from neumat.seeds import seed_for

# Beside the networks, in a checkpoint.
NEEDED = {"captions", "descriptions", "fields", "positions", "orders", "embedded", "appearance.axes"}
# Among its notes: how requests are served, of the config that it was tuned with, and the things that it knows.
SERVED = {"guidance", "candidates", "things"}
TOLD = {"text", "image", "wanted"}  # by which candidates can be told apart
AT_ONCE = 64  # answers to one request, for the memory that their candidates take
# Of the noise on the training materials that answers to a picture begin with: just below `Tuning.settled`, so that the
# unconditional network finishes.
LEVEL = 1.4
EDGE = 6  # a share of 1 / EDGE at each side of a picture is left out: the rest shows nothing but the sphere


class Synthesiser:
    """A conditional model with the encoders that its requests need.

    Attributes: `types`, `categories`: the names that can be asked for. `model`: the ConditionalDiffusion. `weights`
    (N, 675): of the training materials. `guidance` {modality: scale} and `candidates`: how requests are served where
    they don't say themselves, as configured for the run that tuned the model.
    """

    def __init__(self, model):
        self.model = model
        self.types, self.categories = model.notes["types"], model.notes["categories"]
        self.guidance, self.candidates = model.notes["guidance"], model.notes["candidates"]
        extra = dict(model.extra)
        self.captions = normalize(extra.pop("captions").float())
        self.descriptions = Descriptions(extra.pop("descriptions"))
        positions, orders = extra.pop("positions").long(), extra.pop("orders").long()
        self.embedded = extra.pop("embedded").float()[positions]
        self.positions = positions
        self.weights = reorder(extra.pop("fields")[positions], orders)
        state = {name: extra.pop(name) for name in list(extra) if name.startswith("appearance.")}
        self.appearance = AppearanceRegression(
            {name.removeprefix("appearance."): value for name, value in state.items()}
        )
        self.projection = Projection(model.notes["encoder"], extra)
        self.encoder = encoder_of(model.notes["encoder"])

    @functools.cached_property
    def camera(self):
        """The FrozenSphere of pictures, made where one is first needed."""
        return FrozenSphere(*SPHERE)

    @functools.cached_property
    def rendered(self):
        """The `rendered_appearance` of the training materials, rendered where a picture first needs it."""
        fields, positions, orders = distinct(self.weights)
        pictures = rendered_appearance(fields).unflatten(1, (-1, 3))[positions]
        return pictures.gather(2, ORDERS[orders][:, None].expand_as(pictures)).flatten(1)

    @functools.cached_property
    def vocabulary(self):
        """The Vocabulary, made where a text first needs it."""
        return Vocabulary(unpacked(self.model.notes["things"]))

    @classmethod
    def load(cls, path=None):
        """Read the checkpoint that the rule `tune` wrote; without a path, the model that comes with the package.
        Raises NeumatError for another file."""
        path = packaged_model() if path is None else path
        model = ConditionalDiffusion.load(path)
        if missing := (NEEDED - model.extra.keys()) | (SERVED - model.notes.keys()):
            raise NeumatError(path, "a model of this version (rule tune)", f"one without {', '.join(sorted(missing))}")
        return cls(model)

    def synthesise(self, n, seed, guidance=None, candidates=None, progress=iter, **request):
        """Return (weights (n, 675) of valid BRDFs, how many were drawn for them).

        guidance: the scale, or {modality: scale}, see `scale`. candidates: drawn for each of the n where a text or an
        image is given, see `best`. None: the model's own. progress: wraps the list of steps. request: see `encode`.
        Raises NeumatError for a request that cannot be met; warns of colours that are missed.
        """
        texts = [request.pop("text", None)]
        weights, drawn = self.synthesise_each(texts, n, seed, guidance, candidates, progress, **request)
        return weights[0], drawn

    def synthesise_each(self, texts, n, seed, guidance=None, candidates=None, progress=iter, **request):
        """Return the same (t, n, 675) for each of t texts, which are encoded at once, beside what else is asked for:
        each as `synthesise` answers it alone."""
        guidance = self.guidance if guidance is None else guidance
        candidates = self.candidates if candidates is None else candidates
        check_numbers(n, guidance, candidates)
        asked = self.encode(text=None if texts == [None] else texts, **request)
        weights, total = torch.empty(len(texts), n, FIELD), 0
        for k, first in progress([(k, first) for k in range(len(texts)) for first in range(0, n, AT_ONCE)]):
            part = weights[k, first : first + AT_ONCE]
            one = {name: rows if len(rows) == 1 else rows[k : k + 1] for name, rows in asked.items()}
            found, drawn = self.answers(
                one, len(part), seed_for(seed, "answers", first) if first else seed, guidance, candidates
            )
            part[:] = found[0]
            total += drawn
        if "wanted" in asked:
            tell_missed(weights, asked["wanted"])
        return weights, total

    def answers(self, asked, n, seed, guidance, candidates):
        """Return (weights (r, n, 675) of valid BRDFs, how many were drawn for them) that answer r requests, {modality:
        rows (r, size), as encoded}. The best of the candidates are mended, see `generative.anew.served`; each that
        remains no valid BRDF is replaced by the best of candidates of its own."""
        guidance, candidates = scale(guidance, asked), candidates if TOLD & asked.keys() else 1
        requests = len(next(iter(asked.values()), [None]))

        def draw(rows, seed, share):
            first = len(rows) == requests * n
            of, each = (asked, n) if first else ({name: given[rows // n] for name, given in asked.items()}, 1)
            begun = self.start(of, each, candidates)
            repeated = {name: given.repeat_interleave(each * candidates, 0) for name, given in self.embed(of).items()}
            many = len(rows) * candidates
            weights, drawn = self.model.candidates(many, seed, repeated, min(guidance, share * guidance), begun)
            weights = self.recoloured(weights.view(len(rows) // each, each * candidates, -1), of)
            return self.best(weights, of, each).flatten(0, 1), drawn

        weights, drawn = served(draw, requests * n, seed, f"{requests * n} samples at guidance {guidance:g}")
        return weights.view(requests, n, -1), drawn

    def encode(self, type=None, category=None, text=None, image=None, colour=None, force=False):
        """Return {modality: rows (1, size), as encoded} for what is not None; beside them, as "wanted" and "avoided",
        the ranges of appearance that texts or a colour name, see `ranges`.

        type, category: a name; text: words, or a list of t texts, for t rows; image: the path of an image file, or a
        picture uint8 (H, W, 3); colour: its number or name, see `read_colour`; force: see `read_texts`. Raises
        NeumatError for an unknown name, no text or an image that shows nothing; warns of texts that are hardly
        understood, or too long.
        """
        rows = {}
        if type is not None:
            rows["type"] = _one_hot("type", type, self.types)
        if category is not None:
            rows["category"] = _one_hot("category", category, self.categories)
        if text is not None:
            rows |= self.read_texts(text if isinstance(text, list) else [text], force)
        if image is not None:
            picture = image if isinstance(image, torch.Tensor) else read_photo(image)
            check_picture("image", picture)
            rows["image"] = self.encoder.encode_image(picture[None])
        if colour is not None:
            wanted = colour_row(read_colour(colour))
            rows.setdefault("wanted", row()[None])[:, COLOUR] = wanted[COLOUR]
        return rows

    def embed(self, asked):
        """Return {modality: rows (r, size)} as the model takes them, of what `encode` returns."""
        into = {"text": self.projection.text, "image": self.projection.image}
        return {name: into[name](rows) if name in into else rows for name, rows in asked.items() if name not in RANGES}

    def request(self, **request):
        """Return {modality: row (1, size)} as the model takes them; see `encode`."""
        return self.embed(self.encode(**request))

    def start(self, asked, n, candidates):
        """Return what the candidates for n answers to each of r requests, {modality: rows (r, size), as encoded}, begin
        with: (fields (r n candidates, 675), LEVEL), or None for noise alone.

        Where a picture or a text is all that is given, each with another of the training materials that look most like
        what it shows, or answer it best. The tuned network learns the pictures and texts of its training materials by
        heart (for pictures, at noise 6 its error on those of others is three times as large): what is near to a new one
        is better told by retrieval (Blattmann et al. 2022).
        """
        if only_shown(asked):
            order = self.alike(asked["image"])
        elif asked.keys() - RANGES == {"text"}:
            order = self.known.order(self.fit(self.known.seen, colourless(asked)))
        else:
            return None
        order = order[:, torch.arange(n * candidates) % order.shape[1]]  # round and round, where too few are known
        return self.weights[order.flatten()], LEVEL

    @functools.cached_property
    def known(self):
        """The Known training materials."""
        return Known(self.weights, self.positions, self.embedded, self.descriptions)

    def alike(self, features, rendered=None):
        """Return the positions (r, N) of the training materials, or of others that are `rendered` (N, p), those first
        that look most like what each of the encoded pictures (r, i) shows."""
        return torch.cdist(self.appearance(features), self.rendered if rendered is None else rendered).argsort(1)

    def unlike(self, weights, features):
        """Return how far (r, m) fields (r, m, 675) look from what encoded pictures (r, i) show."""
        shown = rendered_appearance(weights.flatten(0, 1)).view(*weights.shape[:2], -1)
        return (shown - self.appearance(features)[:, None]).square().mean(2)

    def recoloured(self, weights, asked):
        """Return candidates (r, m, 675) in the colours of their requests: each that is outside of what is wanted in one
        within, or, where a picture is all that is given, in that which it shows; unless it is no BRDF then."""
        wanted = asked.get("wanted")
        if only_shown(asked) and wanted is None:
            return as_shown(weights, self.appearance(asked["image"]))
        return weights if wanted is None or not coloured(wanted).any() else within(weights, wanted)

    def best(self, weights, asked, n):
        """Return n (r, n, 675) of the candidates (r, m, 675) of each of r requests, {modality: rows (r, size), as
        encoded}. Where nothing tells them apart, the first n.

        Where a picture is all that is given, those that look most like what it shows; else, of those that answer best,
        different ones, see `choice`.
        """
        if not TOLD & asked.keys() or weights.shape[1] == n:
            return weights[:, :n]
        if only_shown(asked):
            best = self.unlike(weights, asked["image"]).argsort(1)[:, :n]
            return weights[torch.arange(len(weights))[:, None], best]
        return choose(weights, self.fit(self.seen(weights.flatten(0, 1), asked).view(*weights.shape[:2]), asked), n)

    def seen(self, weights, asked):
        """Return the Seen of fields (m, 675), see `choice`, by which they are told apart for a request. Pictures are
        drawn where one is asked with: of answers to a text they tell nothing that descriptions don't."""
        looks = appearance(weights)
        if "image" not in asked:
            return Seen(seen(looks), self.descriptions.of(looks))
        edge = self.camera.size // EDGE
        pictures = render_fields(self.camera, weights)[:, edge:-edge, edge:-edge]
        return Seen(seen(looks), self.descriptions.of(looks), self.images(pictures))

    def fit(self, found, asked):
        """Return how well (r, m) what is `Seen` answers r requests, see `choice.fit`."""
        return fit(found, asked, self.embed(asked), self.descriptions)

    def read_texts(self, texts, force=False):
        """Return {"text": texts as encoded, (n, t), of what the encoder can read; "wanted", "avoided": the ranges of
        appearance that they name, (n, SIZE)}.

        Raises NeumatError where nothing can be read or, without `force`, nothing is known, and for what is no text;
        warns of what is not understood.
        """
        for text in texts:
            check_text(text)
        readings = [self.vocabulary.read(text) for text in texts]
        read = [readable_text(reading.plain, self.encoder) for reading in readings]
        features = self.encoder.encode_text(read)
        near = (features @ self.captions.T).amax(1).tolist()
        for text, known, reading, nearest in zip(texts, read, readings, near, strict=True):
            comment(text, known, reading, nearest, self.encoder, force)
        ranges = {name: torch.stack([getattr(reading, name) for reading in readings]) for name in ("wanted", "avoided")}
        return {"text": features} | ranges

    def encode_texts(self, texts, force=False):
        """Return texts as encoded (n, t), see `read_texts`."""
        return self.read_texts(texts, force)["text"]

    def images(self, pictures):
        """Return the embeddings (n, size) of uint8 sRGB pictures (n, H, W, 3)."""
        return self.projection.image(self.encoder.encode_image(pictures))


def scale(guidance, request):
    """Return the guidance scale of a request: `guidance`, or of {modality: scale} the least of what is asked for, since
    what is exaggerated for one modality is lost for another."""
    named = request.keys() - RANGES
    return min((guidance[name] for name in named), default=0.0) if isinstance(guidance, dict) else guidance


def check_numbers(n, guidance, candidates):
    """Raise NeumatError for less than one sample or candidate, and for guidance below -1 or not finite."""
    if n < 1:
        raise NeumatError("n", "at least 1 sample", n)
    if candidates < 1:
        raise NeumatError("candidates", "at least 1", candidates)
    for value in guidance.values() if isinstance(guidance, dict) else [guidance]:
        if not -1 <= value < float("inf"):
            raise NeumatError("guidance", "a finite number of at least -1", value)


def _one_hot(kind, name, names):
    if not names:
        raise NeumatError(kind, f"no {kind}: that of the training materials is unknown", repr(name))
    if name not in names:
        raise NeumatError(kind, f"one of {', '.join(names)}", repr(name))
    return torch.eye(len(names))[names.index(name)][None]
