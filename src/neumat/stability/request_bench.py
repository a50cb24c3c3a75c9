"""What synthesis on demand is stressed on, and what is measured of its answers."""

import resource

import torch

from neumat.brdf.coordinates import grid_angles
from neumat.conditions.choice import off_colour
from neumat.conditions.colour_names import read_colour
from neumat.conditions.ranges import STEP, colour_row, seen
from neumat.fields.field import evaluate
from neumat.fields.validity import physical, valid
from neumat.metrics.alignment import diversity
from neumat.metrics.appearance import appearance
from neumat.metrics.materials import MaterialSet
from neumat.metrics.novelty import nearest_training
from neumat.metrics.words import COLOURS, colour_right, gloss_right
from neumat.stability.stress import ANEW, UNNEEDED, Answer, attempt

N, RAW = 16, 64  # samples of a request; raw draws at a setting
CANDIDATES = 1  # of which a sample is the best: with more, those that were no valid BRDF could not be told
DISTANCE = "brdf_l1_log"


class StressBench:
    """A Synthesiser, and what its samples are measured with.

    entries: flat indices of the MERL grid, and training: fields (n, 675), for distances. guidance: the usual scales,
    {modality: scale}.
    """

    def __init__(self, synthesiser, entries, training, guidance, seed):
        self.synthesiser, self.entries, self.guidance, self.seed = synthesiser, entries, guidance, seed
        self.training = self._materials(training)

    def ask(self, words=(), **request):
        """Return the Answer to a request; words: judged on the samples."""
        return self.answer(*self.synthesiser.synthesise(N, self.seed, self.guidance, CANDIDATES, **request), words)

    def answer(self, weights, drawn, words=()):
        """Return the Answer that the `sample` of a model gave: not right where a sample is no valid BRDF."""
        good = valid(weights)
        found = f"{int(good.sum())} valid of {drawn} drawn{self.measured(weights[good], words)}"
        return Answer(found, bool(good.all()), ANEW if drawn > len(weights) else UNNEEDED)

    def measured(self, weights, words=()):
        """Return in words, of valid fields (n, 675): diversity, median distance to the nearest training material (both
        mean |log(1 + f) - log(1 + f')|), and for how many each word is true. Empty without any."""
        if not len(weights):
            return ""
        materials, seen = self._materials(weights), appearance(weights)
        nearest = nearest_training(materials, self.training, DISTANCE)[0].median()
        judged = [(word, colour_right if word in COLOURS else gloss_right) for word in words]
        shares = [f", {word} {right(seen, word).mean():.0%}" for word, right in judged]
        return f", diversity {diversity(materials):.3f}, nearest training {nearest:.3f}" + "".join(shares)

    def setting(self, guidance=None, model=None, text="red", within=None):
        """Return the Answer of another guidance or model to a colour word, and how far its raw draws are from the usual
        ones of the same noise; not right where that is beyond `within`, mean |log(1 + f) - log(1 + f')|."""
        usual, request = self.synthesiser.model, self.synthesiser.request(text=text)
        model, usually = model or usual, self.guidance["text"]
        guidance = usually if guidance is None else guidance
        raw = model.draw(RAW, self.seed, request, guidance)
        reference = usual.draw(RAW, self.seed, request, usually)
        good = physical(raw)
        both = good & physical(reference)
        f, g = (self._materials(weights[both]).brdf for weights in (raw, reference))
        mean = (f.log1p() - g.log1p()).abs().mean().item()  # NaN where none is left, and then not within anything
        answer = attempt(lambda: self.answer(*model.sample(N, self.seed, request, guidance)))
        found = f"raw: {(~good).sum() / len(raw):.0%} invalid{self.measured(raw[good], [text])}"
        found += f"; from the usual: mean {mean:.2g}"
        found += f", largest {(f - g).abs().max():.2g} / sr" if both.any() else ""
        return Answer(
            f"{found}; then {answer.found}", answer.right and (within is None or mean <= within), answer.guard
        )

    def coloured(self, number):
        """Return the Answer to a colour, with how far the samples are from it, see `conditions.choice.off_colour`."""
        weights, drawn = self.synthesiser.synthesise(N, self.seed, self.guidance, CANDIDATES, colour=number)
        answer = self.answer(weights, drawn)
        off = off_colour(seen(appearance(weights)), colour_row(read_colour(number)))
        found = f"{STEP * off.max():.1f} beyond the tolerance at most (CIELAB), {answer.found}"
        return answer._replace(found=found)

    def many(self, n, most):
        """Return the Answer to a request for n samples; not right where two are the same, or where the process takes
        more than `most` MB more than before."""
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        weights, drawn = self.synthesiser.synthesise(n, self.seed, self.guidance, CANDIDATES, text="red")
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        twice = n - len(weights.unique(dim=0))
        answer = self.answer(weights, drawn)
        found = f"{twice} twice, {'less' if grown < most else 'more'} than {most} MB more, {answer.found}"
        return answer._replace(found=found, right=answer.right and twice == 0 and grown < most)

    def repeated(self, seed):
        """Return the Answer to a text under a seed; not right where a second time differs."""
        (weights, drawn), (again, _) = (
            self.synthesiser.synthesise(N, seed, self.guidance, CANDIDATES, text="red") for _ in range(2)
        )
        answer = self.answer(weights, drawn)
        return answer._replace(right=answer.right and torch.equal(weights, again))

    def _materials(self, weights):
        return MaterialSet(self.entries, evaluate(weights, *grid_angles(self.entries)))
