"""Where synthesis of BTFs breaks: odd exemplars, seams, positions and levels at their limits. See `stability.btf`."""

import functools
import math

import torch

from neumat.btf.synthesis import SYNTHESES
from neumat.metrics.seams import seams
from neumat.seeds import torch_generator
from neumat.stability.cases import case, refused

SEAM = 1.5  # mean step across borders over that elsewhere
SIDE, WAVES = 64, 3  # of the exemplar that shows seams: texels along a side, and waves, at most
BLOCK = 8  # texels along the hard-edged blocks that are to show seams
FITTED = 0.85  # of their largest steps: what fitted ones may have
SPREAD = 4096  # positions, at least, from which standard deviations are taken
OVERSHOOT = 1e-6  # of the exemplar's range: rounding
SHARE = 0.05
TINY = 16  # texels along a side
EXTENT = 4  # exemplars along a side of what seams are looked for in
FAR = 1000  # exemplars under a pixel
LEVEL = 0.01  # standard deviations from the exemplar's mean
PLACES = (1e5, 1e9)
GUARDED = "synthesis.base.Synthesis"


def synthesis_cases(plane, seed, points):
    """Yield the stresses of all methods of SYNTHESES on a `plane` (H, W, c) of features that does not tile; `points`:
    how many random positions are asked for."""
    bench = _Bench(plane, seed, points)
    yield from _seams(bench)
    yield from _odd_exemplars(bench)
    for value in (math.nan, math.inf):
        for name, method in SYNTHESES.items():
            yield refused(f"a {value} in a plane: {name}", "a plane of finite features", GUARDED,
                          lambda method=method, value=value: _broken(bench, method, value))  # fmt: skip
    yield from _places(bench)
    yield from _batches(bench)
    yield from _levels(bench)


class _Bench:
    def __init__(self, plane, seed, points):
        self.plane, self.seed, self.points = plane, seed, points
        self._made = {}

    def made(self, name):
        """Return the method `name` on the plane."""
        if name not in self._made:
            self._made[name] = SYNTHESES[name](self.plane, self.seed)
        return self._made[name]

    def positions(self, name, cells=1 << 20, least=0):
        """Return random cells (n, 2) and fractions (n, 2) that float64 holds exactly, up to cell 2^33."""
        generator, count = torch_generator(self.seed, name), max(self.points, least)
        cell = torch.randint(-cells, cells, (count, 2), generator=generator)
        fraction = torch.randint(1 << 19, (count, 2), generator=generator).double() / (1 << 19)
        return cell, fraction

    def features(self, method, name="positions", level=0.0, least=0):
        """Return features (n, c) of a method at random positions, at least so many."""
        return method.at_cell(*self.positions(name, least=least), level)


def _endless(method, extent=EXTENT):
    """Return a patch (extent H, extent W, c) of a method's plane, at the centres of texels."""
    y, x = ((torch.arange(extent * n, dtype=torch.float64) + 0.5) / n for n in (method.height, method.width))
    u = torch.stack(torch.meshgrid(y, x, indexing="ij")[::-1], -1)
    return method.at(u.flatten(0, 1)).view(len(y), len(x), -1)


def _seams(bench):
    plane = _waves(bench.seed)
    made = functools.cache(lambda name: SYNTHESES[name](plane, bench.seed))
    borders = [torch.arange(1, EXTENT) * SIDE] * 2

    def across(name, *borders):
        found = seams(_endless(made(name)), *borders)
        return f"{found:.2f}", found > SEAM if name == "tiling" else found <= SEAM

    for name in SYNTHESES:
        control = name == "tiling"
        yield case(f"exemplar that does not tile: {name}",
                   f"mean step across the exemplar's borders {'above' if control else 'at most'} {SEAM:g} times that "
                   f"elsewhere{' (control: it must show)' if control else ''}",
                   "none: a null" if control else "patches keep inside an exemplar unless `tileable`",
                   lambda name=name: across(name, *borders))  # fmt: skip

    def tiles():
        corners = [torch.arange(step, EXTENT * SIDE - 1, step) for step in made("corner").steps]
        return across("corner", *(torch.cat([at, at + 1]) for at in corners))

    yield case("borders of corner tiles", f"mean step across them at most {SEAM:g} times that elsewhere", "tiles share "
               "the samples on their borders", tiles)  # fmt: skip

    def cut(name):
        found = _largest_steps(_endless(made(name))) / own
        return f"{found:.2f}", found <= most

    own = _largest_steps(plane)
    most = FITTED * _largest_steps(_shuffled(plane, bench.seed)) / own
    for name in SYNTHESES:
        if name != "tiling":
            yield case(f"seams in a smooth exemplar, where nothing hides them: {name}", "the largest of 1000 steps "
                       f"between texels at most {most:.2f} times the exemplar's: {FITTED:g} times what blocks of "
                       f"{BLOCK} x {BLOCK} texels that are not fitted show", "patches are blended, or cut along least "
                       "errors", lambda name=name: cut(name))  # fmt: skip


def _waves(seed):
    """Return a plane (SIDE, SIDE, 6) of long waves, none of which ends at the border."""
    generator = torch_generator(seed, "waves")
    x, y = (torch.randint(-WAVES, WAVES + 1, (2, 40), generator=generator) + 0.37)[:, None, None]
    place = torch.arange(SIDE) / SIDE
    phases = x * place[:, None] + y * place[:, None, None] + torch.rand(40, generator=generator)
    return torch.sin(2 * math.pi * phases) @ torch.randn(40, 6, generator=generator)


def _largest_steps(plane):
    """Return the quantile .999 of the lengths of steps between neighbouring texels of a plane."""
    steps = [plane.diff(dim=axis).norm(dim=-1).flatten() for axis in (0, 1)]
    steps = torch.cat(steps).sort().values
    return steps[int(0.999 * (len(steps) - 1))].item()


def _shuffled(plane, seed):
    """Return a plane with its blocks in random order."""
    rows, columns = (n // BLOCK for n in plane.shape[:2])
    blocks = plane[: rows * BLOCK, : columns * BLOCK].unflatten(0, (rows, BLOCK)).unflatten(2, (columns, BLOCK))
    blocks = blocks.transpose(1, 2).flatten(0, 1)
    blocks = blocks[torch.randperm(len(blocks), generator=torch_generator(seed, "blocks"))]
    blocks = blocks.unflatten(0, (rows, columns)).transpose(1, 2)
    return blocks.flatten(2, 3).flatten(0, 1)


def _odd_exemplars(bench):
    channels = bench.plane.shape[2]
    generator = torch_generator(bench.seed, "exemplars")
    field = _waves(bench.seed)[..., 0]
    pattern = field > field.quantile(0.7)
    ends = torch.randn(2, channels, generator=generator)
    exemplars = {
        f"tiny exemplar, {TINY} x {TINY}": bench.plane[:TINY, :TINY].contiguous(),
        "exemplar of one texel": bench.plane[:1, :1].contiguous(),
        "exemplar of 3 x 5 texels": bench.plane[:3, :5].contiguous(),
        "one colour": ends[0].expand_as(bench.plane).contiguous(),
        "two colours": ends[pattern.long()],
    }

    def within(name, plane):
        features = bench.features(SYNTHESES[name](plane, bench.seed))
        low, high = (getattr(plane.flatten(0, 1), end)(0).values for end in ("min", "max"))
        beyond = torch.maximum(low - features, features - high).amax().clamp_min(0).item()
        reference = (high - low).max().item() or high.abs().max().item()
        return f"beyond by {beyond / reference:.2g}", bool(
            features.isfinite().all()
        ) and beyond <= OVERSHOOT * reference

    for kind, plane in exemplars.items():
        for name in SYNTHESES:
            yield case(f"{kind}: {name}", f"finite, beyond the exemplar's features by at most {OVERSHOOT:g} of their "
                       "range", "blends are cut to the exemplar's range",
                       lambda name=name, plane=plane: within(name, plane))  # fmt: skip

    def shares(name):
        exemplar = exemplars["two colours"]
        features = bench.features(SYNTHESES[name](exemplar, bench.seed), least=SPREAD)
        span = ends[1] - ends[0]
        place = ((features - ends[0]) @ span / span.square().sum()).mean().item()
        share = pattern.double().mean().item()
        return f"{place:.3f}, exemplar {share:.3f}", abs(place - share) < SHARE

    for name in (name for name in SYNTHESES if hasattr(bench.made(name), "gaussian")):
        yield case(f"share of the second of two colours: {name}", f"within {SHARE:g} of the exemplar's",
                   "ranks count texels by how often they appear, and equal values by their surroundings",
                   lambda name=name: shares(name))  # fmt: skip


def _broken(bench, method, value):
    plane = bench.plane.clone()
    plane[1, 2, 0] = value
    method(plane, bench.seed)
    return "accepted", False


def _places(bench):
    def same(place):
        found = []
        for name in SYNTHESES:
            cell, fraction = bench.positions(f"at {place:g}", 1 << 6)
            cell = cell + int(place)
            method = bench.made(name)
            if not torch.equal(method.at(cell + fraction), method.at_cell(cell, fraction)):
                found.append(name)
        return f"other bits in {', '.join(found) or 'none'} of {len(SYNTHESES)}", not found

    def alike(place):
        cell, fraction = bench.positions("spread", 1 << 4, SPREAD)
        worst = 0.0
        for name in SYNTHESES:
            near, far = (bench.made(name).at_cell(cell + int(at), fraction).std(0) for at in (0, place))
            worst = max(worst, (far / near - 1).abs().max().item())
        return f"at most {worst:.1%}", worst < 0.1

    for place in PLACES:
        yield case(f"u about {place:g}", "for all methods the bits that an integer cell and a fraction give",
                   "choices hash integers, float64 positions", lambda place=place: same(place))  # fmt: skip
        yield case(f"spread of features about u = {place:g}", "standard deviations of all channels within 10 % of "
                   "those about 0", "choices hash integers", lambda place=place: alike(place))  # fmt: skip

    def odd(value):
        u = torch.rand(8, 2, dtype=torch.float64, generator=torch_generator(bench.seed, "odd"))
        expected = {name: bench.made(name).at(u) for name in SYNTHESES}
        u[3, 1] = value
        wrong = []
        for name, right in expected.items():
            found = bench.made(name).at(u)
            rest = torch.arange(8) != 3
            if not (found[3].isnan().all() and torch.equal(found[rest], right[rest])):
                wrong.append(name)
        return f"otherwise in {', '.join(wrong) or 'none'} of {len(SYNTHESES)}", not wrong

    for value in (math.nan, math.inf, 1e300):
        yield case(f"u is {value:g} in one query of 8", "NaN there, no other query changed, for all methods", GUARDED,
                   lambda value=value: odd(value))  # fmt: skip

    def odd_level(value, expected):
        u = torch.rand(8, 2, dtype=torch.float64, generator=torch_generator(bench.seed, "odd"))
        wrong = []
        for name in SYNTHESES:
            level = torch.ones(8)
            right = bench.made(name).at(u, level)
            level[3] = value
            right[3] = math.nan if expected is None else bench.made(name).at(u, expected)[3]
            if not torch.equal(bench.made(name).at(u, level).nan_to_num(nan=1e9), right.nan_to_num(nan=1e9)):
                wrong.append(name)
        return f"otherwise in {', '.join(wrong) or 'none'} of {len(SYNTHESES)}", not wrong

    for value, what, expected in ((math.inf, "the mean", 50.0), (-math.inf, "level 0", 0.0), (math.nan, "NaN", None)):
        yield case(f"level of detail {value} in one query of 8", f"{what} there, no other query changed, for all "
                   "methods", GUARDED, lambda value=value, expected=expected: odd_level(value, expected))  # fmt: skip


def _batches(bench):
    def same():
        cell, fraction = bench.positions("batches")
        level = torch.rand(len(cell), generator=torch_generator(bench.seed, "levels")) * 3
        order = torch.randperm(len(cell), generator=torch_generator(bench.seed, "order"))
        wrong = []
        for name in SYNTHESES:
            method = bench.made(name)
            whole = method.at_cell(cell, fraction, level)
            turned = method.at_cell(cell[order], fraction[order], level[order])
            parts = [method.at_cell(cell[k : k + 1], fraction[k : k + 1], level[k : k + 1]) for k in range(16)]
            if not (torch.equal(whole[order], turned) and torch.equal(whole[:16], torch.cat(parts))):
                wrong.append(name)
        return f"other bits in {', '.join(wrong) or 'none'} of {len(SYNTHESES)}", not wrong

    yield case("order and size of the batch, fractional levels", "the same bits for all methods",
               "sums of fixed order, no products of matrices", same)  # fmt: skip


def _levels(bench):
    rows = bench.plane.flatten(0, 1)
    level = math.log2(FAR * max(bench.plane.shape[:2]))

    def mean(name):
        off = ((bench.features(bench.made(name), "far", level) - rows.mean(0)) / rows.std(0)).abs().max().item()
        return f"off by {off:.2g} standard deviations", off <= LEVEL

    for name in SYNTHESES:
        yield case(f"{FAR} exemplars under a pixel: {name}", "every feature within "
                   f"{LEVEL:g} standard deviations of the exemplar's mean", "levels of detail, a table for each",
                   lambda name=name: mean(name))  # fmt: skip
