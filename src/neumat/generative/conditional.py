"""Diffusion under conditions: the unconditional model fine-tuned on requests, and classifier-free guidance."""

import functools
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from torch import nn

from neumat.checkpoints import read_checkpoint, write_checkpoint
from neumat.errors import NeumatError
from neumat.fields.validity import physical
from neumat.generative.anew import drawn_anew, served
from neumat.generative.base import SCHEMA as BASE
from neumat.generative.denoisers import LEVEL_WIDTH
from neumat.generative.hyperdiffusion import HyperDiffusion
from neumat.generative.orders import OrderOfRequest, colours
from neumat.generative.schedule import Denoiser, loguniform_sigmas
from neumat.generative.training import device, seeded, train

SCHEMA = f"4.{BASE}"  # its own, and that of the model that it was tuned from
MODALITIES = ("type", "category", "text", "image")
HIDDEN = 256
COLOURED = ("text", "image")  # those that may say which colour


class RequestEmbedding(nn.Module):
    """What is asked for, as an addition to the embedded noise level: {modality: (n, size)} -> (n, LEVEL_WIDTH).

    `present` (n, modalities), 0 or 1, says which modalities were given. The last layer starts at zero, so that
    fine-tuning starts from the unconditional model.
    """

    def __init__(self, sizes):
        super().__init__()
        self.sizes = sizes
        self.enter = nn.ModuleList(nn.Linear(size, HIDDEN) for size in sizes.values())
        self.net = nn.Sequential(nn.SiLU(), nn.Linear(HIDDEN, HIDDEN), nn.SiLU(), nn.Linear(HIDDEN, LEVEL_WIDTH))
        nn.init.zeros_(self.net[-1].weight)
        nn.init.zeros_(self.net[-1].bias)

    def forward(self, request, present):
        # Rows have length 1: scaled so that their entries are as large as the layers' initial weights expect.
        scaled = (request[name] * size**0.5 for name, size in self.sizes.items())
        entered = (enter(rows) for enter, rows in zip(self.enter, scaled, strict=True))
        return self.net(sum(present[:, k, None] * part for k, part in enumerate(entered)))


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """Hyperparameters of the fine-tuning. given: the probability that a modality is given in a training example (one
    is always given); jitter: length of the noise on embedded texts and images, which lie on the unit sphere; settled:
    the noise level below which a sample's kind is settled: the tuned network is trained and used above it only, and
    the unconditional one, which has learnt the finer levels for longer, finishes; steps, batch, lr, warmup: see
    `training.train`."""

    steps: int = 4000
    batch: int = 256
    lr: float = 2e-3
    warmup: int = 100
    given: float = 0.25
    jitter: float = 0.2
    settled: float = 1.5


class ConditionalDiffusion:
    """A fitted HyperDiffusion, and a copy of its network that was tuned to requests.

    A request is {modality: tensor (n, size) or (1, size)} for any of MODALITIES (but for types where no material has
    one): rows of type sum to 1 over the types
    asked for, rows of category hold one 1, text and image are embeddings of unit length. Without any it is the
    unconditional model itself. notes: a dict that JSON can hold, and extra: a dict of tensors, both kept in the
    checkpoint for whoever makes requests. Where the base sorts channels, so do the networks here, and one more tells
    which order of them answers to a text or an image (`orders.OrderOfRequest`), trained beside the tuning.
    """

    def __init__(self, base, tuning, notes, extra):
        self.base, self.tuning, self.notes, self.extra = base, tuning, notes, extra

    def fit(self, weights, conditions, seed, progress=None, checkpoint=None):
        """Tune the network to weights (n, 675) and their conditions; return self.

        conditions: type (n, T), T = 0 where no type is known; category (n, C), 0 or 1: a material may be in several;
        text (n, p, size) and image (n, a, size), of which one is drawn at each use; said (n,), how often a material is
        drawn where a text is given, in proportion. See GenerativeModel.fit for the other arguments.
        """
        tuning = self.tuning
        coordinates, denoiser = self.base.restored()
        weights, order = self.base.sorted(weights)
        data, seen = coordinates.encode(weights), colours(weights)
        # What no material has cannot be asked for: no type, where the sources are the user's own.
        self.sizes = {name: size for name in MODALITIES if (size := conditions[name].shape[-1])}
        known = list(self.sizes)
        on = device()
        with seeded(seed, "request"):
            both = self._networks(denoiser.network).to(on)
        highest = self.base.sampling_levels()[0].item()

        def loss(generator):
            given = _given(tuning.batch, len(known), tuning.given, generator)
            rows = torch.randint(len(data), (tuning.batch,), generator=generator)
            spoken = torch.multinomial(conditions["said"], tuning.batch, replacement=True, generator=generator)
            rows = torch.where(given[:, known.index("text")] > 0, spoken, rows)
            category, members = _members(conditions["category"], tuning.batch, generator)
            rows = torch.where(given[:, known.index("category")] > 0, members, rows)
            asked = {"category": category}
            if "type" in known:
                asked["type"] = conditions["type"][rows]
            for name in ("text", "image"):
                choice = torch.randint(conditions[name].shape[1], (tuning.batch,), generator=generator)
                noise = torch.randn(tuning.batch, self.sizes[name], generator=generator)
                asked[name] = conditions[name][rows, choice] + tuning.jitter / self.sizes[name] ** 0.5 * noise
            asked, given = {name: rows.to(on) for name, rows in asked.items()}, given.to(on)
            network = functools.partial(both["network"], condition=both["request"](asked, given))
            clean = data[rows]
            noise = torch.randn(clean.shape, generator=generator)
            levels = loguniform_sigmas(tuning.batch, tuning.settled, highest, generator)
            total = Denoiser(network, self.base.preconditioning).loss(clean.to(on), levels.to(on), noise.to(on))
            if self.base.sort:
                # In bfloat16 a material's six orders get nearly the same logits: it learns .70 of them, not .97.
                with torch.autocast(on.type, enabled=False):
                    logits = both["order"](seen[rows].to(on), asked, self._coloured(given))
                total = total + nn.functional.cross_entropy(logits, order[rows].to(on))
            return total

        train(
            both, loss, steps=tuning.steps, lr=tuning.lr, warmup=tuning.warmup, precision=self.base.precision,
            seed=seed, progress=progress or (lambda steps: steps), checkpoint=checkpoint and Path(checkpoint),
            identity=[asdict(self.base), asdict(tuning)],
        )  # fmt: skip
        self.state = {name: value.cpu() for name, value in both.state_dict().items()}
        return self

    def draw(self, n, seed, request, guidance=0.0, start=None):
        """Return n weight vectors (n, 675), float32, as the sampler leaves them: some may be no valid BRDF.

        guidance: w of M3ashy's algorithm 1, D = (1 + w) D(x | request) - w D(x). -1 is exactly the unconditional
        model, 0 the conditional one. The algorithm is printed with three slips: alpha_t is a product of square roots
        and gamma_t the product of those again, over an index that is also its bound, whereas its own last two lines
        are those of DDIM (Song et al. 2021, eq. 12) for gamma_t = prod (1 - beta_s); and guidance is linear in the
        predicted noise, so it is the same thing for D, which is what any of our samplers takes.

        start: (fields (n, 675), level of noise) to begin with; see HyperDiffusion.integrate.

        Raises NeumatError for n below 1, a guidance below -1 or not finite, or a request that does not fit.
        """
        if n < 1:
            raise NeumatError("n", "at least 1 sample", n)
        if not -1 <= guidance < float("inf"):
            raise NeumatError("guidance", "a finite number of at least -1", guidance)
        if not request or guidance == -1:
            return self.base.draw(n, seed, start)
        coordinates, unconditional = self.base.restored()
        networks = self._restored(coordinates.into.shape[1])
        asked, given = self._filled(n, request)
        with torch.no_grad():
            condition = networks["request"](asked, given)

        def denoise(x, sigma, rows):
            if sigma < self.tuning.settled:
                return unconditional(x, sigma)
            tuned = Denoiser(
                functools.partial(networks["network"], condition=condition[rows]), self.base.preconditioning
            )
            wanted = tuned(x, sigma)
            return wanted if guidance == 0 else wanted + guidance * (wanted - unconditional(x, sigma))

        def likely(weights):
            logits = networks["order"](colours(weights).to(device()), asked, self._coloured(given))
            return (1 + guidance) * logits.cpu()  # guided as D is: without a request all orders are alike

        return self.base.integrate(denoise, coordinates, n, seed, start, likely)

    def candidates(self, n, seed, request, guidance=0.0, start=None):
        """Return (weights (n, 675) of BRDFs, how many were drawn for them). See `draw`.

        What is no BRDF (`fields.validity.physical`) is drawn anew, at half the guidance each time where that is
        positive: exaggeration is what breaks most. Raises NeumatError where after some rounds some is still missing.
        """

        def draw(rows, seed, share):
            asked, begun = of_rows(rows, request, start)
            return self.draw(len(rows), seed, asked, min(guidance, share * guidance), begun), len(rows)

        return drawn_anew(draw, physical, n, seed, f"{n} samples at guidance {guidance:g}")

    def sample(self, n, seed, request, guidance=0.0, start=None):
        """Return the same of `candidates` that are served, see `generative.anew`: `valid` in other programs too."""

        def draw(rows, seed, share):
            asked, begun = of_rows(rows, request, start)
            return self.candidates(len(rows), seed, asked, min(guidance, share * guidance), begun)

        return served(draw, n, seed, f"{n} samples at guidance {guidance:g}")

    def _filled(self, n, request):
        """Return ({modality: (n, size)} with zeros where not asked, which were given (n, modalities))."""
        filled = {}
        for name in request:
            if name not in self.sizes:
                raise NeumatError("request", f"one of {', '.join(self.sizes)}", name)
        for name, size in self.sizes.items():
            rows = request.get(name, torch.zeros(1, size))
            if rows.shape not in ((n, size), (1, size)):
                raise NeumatError(f"{name} of the request", f"rows ({n} or 1, {size})", tuple(rows.shape))
            if not torch.isfinite(rows).all():
                raise NeumatError(f"{name} of the request", "finite numbers", rows[~torch.isfinite(rows)][0].item())
            filled[name] = rows.expand(n, -1).to(device())
        given = torch.tensor([[float(name in request) for name in self.sizes]], device=device())
        return filled, given.expand(n, -1)

    def _coloured(self, given):
        return given[:, [list(self.sizes).index(name) for name in COLOURED]]

    def _networks(self, network):
        networks = {"network": network, "request": RequestEmbedding(self.sizes)}
        if self.base.sort:
            networks["order"] = OrderOfRequest(RequestEmbedding({name: self.sizes[name] for name in COLOURED}))
        return nn.ModuleDict(networks)

    def _restored(self, size):
        networks = self._networks(self.base._denoiser(size).network)
        networks.load_state_dict(self.state)
        return networks.to(device()).eval()

    def save(self, path):
        """Write everything that sampling needs as safetensors: both networks, notes and extra tensors."""
        metadata = {
            "schema": SCHEMA,
            "model": type(self).__name__,
            "base": json.dumps(asdict(self.base)),
            "tuning": json.dumps(asdict(self.tuning)),
            "notes": json.dumps(self.notes),
            "sizes": json.dumps(self.sizes),
        }
        groups = {"base": self.base.state, "tuned": self.state, "extra": self.extra}
        tensors = {f"{group}/{k}": v for group, members in groups.items() for k, v in members.items()}
        write_checkpoint(path, metadata, tensors)

    @classmethod
    def load(cls, path):
        """Read a model that `save` wrote. Raises NeumatError for another file, class or schema version."""
        metadata, tensors = read_checkpoint(path, "a saved conditional model", SCHEMA, cls.__name__)
        base, tuning, notes, sizes = (json.loads(metadata[key]) for key in ("base", "tuning", "notes", "sizes"))
        groups = {"base": {}, "tuned": {}, "extra": {}}
        for name, value in tensors.items():
            group, key = name.split("/", 1)
            groups[group][key] = value.float() if value.dtype == torch.float16 else value
        model = cls(HyperDiffusion(**base), Tuning(**tuning), notes, groups["extra"])
        model.base.state, model.state, model.sizes = groups["base"], groups["tuned"], sizes
        return model


def of_rows(rows, request, start):
    """Return a request, {modality: (n, size) or (1, size)}, and what it begins with, see `ConditionalDiffusion.draw`,
    of the positions `rows` (k,) among the n."""
    asked = {name: given if len(given) == 1 else given[rows] for name, given in request.items()}
    return asked, start and (start[0][rows], start[1])


def _given(n, modalities, probability, generator):
    """Return float (n, modalities): each modality given with `probability`, and one at random where none was."""
    given = torch.rand(n, modalities, generator=generator) < probability
    one = torch.randint(modalities, (n,), generator=generator)
    given[torch.arange(n), one] |= ~given.any(1)
    return given.float()


def _members(category, n, generator):
    """Return (one-hot categories (n, C), a member of each (n,)) of membership (m, C): a category that is not empty
    drawn evenly, then one of its members, so that the model learns what a category holds, however rare it is."""
    counts = category.sum(0).long()
    filled = counts.nonzero()[:, 0]
    chosen = filled[torch.randint(len(filled), (n,), generator=generator)]
    ordered = category.T.nonzero()[:, 1]  # the members of the first category, then of the second, ...
    start = counts.cumsum(0) - counts
    position = start[chosen] + (torch.rand(n, generator=generator) * counts[chosen]).long()
    return nn.functional.one_hot(chosen, category.shape[1]).float(), ordered[position]
