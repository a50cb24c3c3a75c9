"""Where representations of BTFs break: odd materials, few and noisy captures, coarse features. See `stability.btf`."""

import functools
import math

import torch

from neumat.btf.endless import endless
from neumat.btf.exposure import exposure
from neumat.btf.synthesis import SYNTHESES
from neumat.seeds import torch_generator
from neumat.stability.btf_bench import CEILING, PATHS, accepted, all_values, at_texels, brightest, of_values
from neumat.stability.cases import case, refused, warned

DARK = 1e-3
TINY = 16  # texels along a side
STEEP = 4  # times the relief
MANY = 16  # paths a value
COLOUR = 0.2
AFAR = (1, 2, 3)  # levels of detail
BLENDED = 2  # the one at which syntheses are asked
NOISES = {0.05: 0.3, 0.5: 3.0}  # relative, of all values: what may be lost, dB


def fit_cases(bench):
    """Yield the stresses of the representations of a BtfBench."""
    yield from _materials(bench)
    yield from _captures(bench)
    yield from _features(bench)


def _materials(bench):
    def odd(surface, least, texels=None):
        store, truth = bench.captured(surface, texels=texels), bench.held_out(surface, texels)
        fitted, mean = bench.fitted(store), bench.fitted(store, "mean")
        ours, null = (bench.psnr(model, truth, store) for model in (fitted, mean))
        bright = at_texels(fitted, *bench.random_pairs(bench.queries, math.radians(85))).max().item() / brightest(store)
        found = f"{ours:.1f} dB, mean BRDF {null:.1f} dB; mean {bench.brightness(fitted, truth):.0%} of the captured, "
        found += f"brightest value {bright:.2g} times the captured"
        return found, ours >= null + least and bright <= 1.01

    for material in ("chrome", "specular-black-phenolic"):
        yield warned(f"mirror: a surface of {material}", "no worse than the mean BRDF, not brighter than captured; "
                     "highlights are lost", "times the captured brightness", "`Representation.fit` warns",
                     lambda material=material: odd(bench.changed(material), 0.0))  # fmt: skip
    yield case(f"tiny exemplar, {TINY} x {TINY} texels", "finite, at least 1 dB above the mean BRDF, not brighter than "
               "captured", CEILING, lambda: odd(bench.changed(), 1.0, TINY))  # fmt: skip

    def steep():
        found, right = odd(bench.changed(relief=STEEP), 0.0)
        flat = bench.psnr(bench.ours)
        return f"{found}; {flat:.1f} dB at 1 x", right

    yield case(f"relief {STEEP} x, beyond what planes can follow", "finite, no worse than the mean BRDF, not brighter "
               "than captured", "the table of relief says what is lost", steep)  # fmt: skip

    def dark():
        store, truth = (of_values(each, all_values(each) * DARK) for each in (bench.base, bench.truth))
        usual, found = bench.psnr(bench.ours), bench.psnr(bench.fitted(store), truth, store)
        return f"{found:.1f} dB at an exposure {1 / DARK:g} times as long, {usual:.1f} dB as captured", (
            found > usual - 0.5
        )

    yield case(f"near black: all values times {DARK:g}", "relative errors as before, to 0.5 dB", "exposure is taken "
               "from the store; float16 holds 6e-8 / sr", dark)  # fmt: skip
    yield refused("a black capture", "is above 0", "`btf.exposure`",
                  lambda: accepted(bench.fitted(of_values(bench.base, 0 * all_values(bench.base)))))  # fmt: skip

    def grey():
        texel = torch.arange(bench.texels**2) % bench.base.pairs
        light = bench.base.light[:, texel, 2].view(-1, bench.texels, bench.texels, 1)
        model = bench.fitted(of_values(bench.base, (light / math.pi * 0.2).expand(-1, -1, -1, 3)))
        light, view = bench.random_pairs(64, math.radians(75))
        expected = light[:, 2:] / math.pi * 0.2
        pictures = torch.stack([model.picture(*pair) for pair in zip(light, view, strict=True)])
        off = (pictures / expected[:, None, None] - 1).abs().mean((1, 2, 3))
        return f"off by {off.mean():.1%}, at the worst pair {off.max():.1%}", off.mean().item() < 0.05

    yield case("one colour: a flat Lambertian surface", "its albedo over pi times the cosine of the light to 5 % in "
               "the mean", "none needed", grey)  # fmt: skip


def _captures(bench):
    def few(store, count):
        pictures, null = (bench.psnr(bench.fitted(store, name)) for name in ("ours", "mean"))
        some = slice(0, min(count, bench.base.sweeps))
        queries = of_values(bench.base, bench.base.values(torch.arange(bench.base.sweeps)[some]), some)
        drawn = bench.psnr(bench.fitted(queries))
        found = f"{pictures:.1f} dB, their mean BRDF {null:.1f} dB; {count} sweeps of random queries {drawn:.1f} dB"
        return found, pictures >= null and drawn >= pictures

    for side in (9, 5):
        yield case(f"few directions: {side**2} pictures, {side} views under {side} lights", "no worse than their mean "
                   "BRDF; random queries, as many values, no worse than pictures", "captures are of random queries",
                   lambda side=side: few(bench.grid(side), side**2))  # fmt: skip

    many = functools.cache(lambda: bench.fitted(bench.captured(paths=MANY)))

    def paths(few, least):
        darker, shown = (bench.brightness(few, shown=s) / bench.brightness(many(), shown=s) for s in (False, True))
        found = f"{bench.psnr(few):.1f} dB, {MANY} paths {bench.psnr(many()):.1f} dB; mean {darker:.0%} of theirs, "
        return f"{found}{shown:.0%} as shown", bench.psnr(few) > bench.psnr(many()) - 2 and shown > least

    yield case(f"noisy captures: {PATHS} paths a value, {MANY // PATHS} times as many values", "at most 2 dB worse "
               f"than {MANY} paths; mean brightness as shown at least 85 % of theirs", "the default of captures",
               lambda: paths(bench.ours, 0.85))  # fmt: skip
    yield case(f"noisy captures: 1 path a value, {MANY} times as many values", f"at most 2 dB worse than {MANY} paths; "
               "mean brightness as shown at least 60 % of theirs", f"captures take {PATHS} paths a value",
               lambda: paths(bench.fitted(bench.captured(paths=1)), 0.6))  # fmt: skip

    def noisy(share, most):
        noise = torch.randn(all_values(bench.base).shape, generator=torch_generator(bench.seed, "noise"))
        store = of_values(bench.base, (all_values(bench.base) * (1 + share * noise)).clamp_min(0))
        found, usual = bench.psnr(bench.fitted(store)), bench.psnr(bench.ours)
        return f"{found:.2f} dB, without {usual:.2f} dB", found > usual - most

    for share, most in NOISES.items():
        yield case(f"noise of {share:.0%} on all values", f"at most {most:g} dB worse", "features of a texel see "
                   "all of its values", lambda share=share, most=most: noisy(share, most))  # fmt: skip


def _features(bench):
    def coarse(bits):
        plane = bench.ours.positional()
        low, high = plane.amin((0, 1)), plane.amax((0, 1))
        step = (high - low) / (2**bits - 1)
        return bench.psnr(Planed(bench.ours, low + ((plane - low) / step).round() * step))

    def eight_bits():
        eight, six, four, usual = coarse(8), coarse(6), coarse(4), bench.psnr(bench.ours)
        found = f"8 bits {eight:.2f} dB, 6 bits {six:.2f} dB, 4 bits {four:.2f} dB, float16 {usual:.2f} dB"
        return found, eight > usual - 0.2

    yield case("plane of positions in 8 bits", "at most 0.2 dB worse", "range of every channel of its own", eight_bits)

    def batches():
        light, view = bench.random_pairs(bench.queries, math.radians(85))
        features = bench.ours.positional().flatten(0, 1)
        features = features[torch.arange(bench.queries) % len(features)]
        whole = bench.ours.eval(features, light, view)
        order = torch.randperm(bench.queries, generator=torch_generator(bench.seed, "order"))
        turned = bench.ours.eval(features[order], light[order], view[order])
        alone = torch.cat([bench.ours.eval(features[k : k + 1], light[k : k + 1], view[k : k + 1]) for k in range(64)])
        off = max((whole[order] - turned).abs().max().item(), (whole[:64] - alone).abs().max().item())
        off /= whole.max().item()
        return f"at most {off:.1g} of the brightest", off < 1e-6

    yield case("order and size of the batch that is decoded", "the same to 1e-6 of the brightest", "none needed",
               batches)  # fmt: skip

    def coloured(features):
        shown, linear, bright = [], [], 0.0
        for pair in zip(bench.truth.light, bench.truth.view, strict=True):
            both = bench.ours.eval(features, *pair), bench.ours.eval(bench.ours.positional().flatten(0, 1), *pair)
            bright = max(bright, both[0].max().item() / brightest(bench.base))
            cut = [(exposure(bench.base) * values).clamp_max(1) for values in both]
            for found, (ours, own) in ((shown, cut), (linear, both)):
                found.append((ours.mean(0) / own.mean(0) - 1).abs().mean().item())
        shown, linear = (sum(found) / len(found) for found in (shown, linear))
        found = f"{shown:.1%} off as shown, {linear:.1%} in linear values; brightest {bright:.2f} times the captured"
        return found, shown < COLOUR and bright <= 1.01

    synthesis = functools.cache(lambda name: endless(bench.ours, name, bench.seed, False).synthesis)

    def synthesised(name, level):
        u = torch.rand(bench.queries, 2, dtype=torch.float64, generator=torch_generator(bench.seed, "u")) * 1e3
        return coloured(synthesis(name).at(u, level))

    expectation = f"mean colours of the exemplar's pictures, as shown, to {COLOUR:.0%}; not brighter than captured"
    for name in SYNTHESES:
        yield case(f"colour of 1000 exemplars of synthesis: {name}", expectation, "features are cut to the exemplar's "
                   "range", lambda name=name: synthesised(name, 0.0))  # fmt: skip
        yield case(f"colour of 1000 exemplars of synthesis, {2**BLENDED} x {2**BLENDED} texels under a pixel: {name}",
                   expectation, "synthesis fetches the levels that are trained",
                   lambda name=name: synthesised(name, BLENDED))  # fmt: skip

    def from_afar(level):
        return coloured(bench.ours.levels()[level].flatten(0, 1))

    for level in (*AFAR, -1):
        side = f"{2**level} x {2**level}" if level > 0 else "all"
        yield case(f"colour from afar: features of a level of detail, {side} texels", expectation, "levels are trained "
                   "to decode to means of values", lambda level=level: from_afar(level))  # fmt: skip


class Planed:
    """A representation with another plane (H, W, c) of positions."""

    def __init__(self, model, plane):
        self.model, self.plane = model, plane

    def picture(self, light, view):
        """Return the values (H, W, 3) at all texels for one pair of unit vectors (3,)."""
        return self.model.eval(self.plane.flatten(0, 1), light[None], view[None]).view(*self.plane.shape[:2], 3)
