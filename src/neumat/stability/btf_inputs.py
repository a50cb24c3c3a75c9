"""Where representations of BTFs break: directions, features and stores that no capture has. See `stability.btf`."""

import functools
import math

import h5py
import torch

from neumat.btf.directions import random_directions, spherical
from neumat.btf.representations.registry import REPRESENTATIONS
from neumat.btf.store import attributes, read_btf, write_btf
from neumat.seeds import torch_generator
from neumat.stability.btf_bench import CEILING, accepted, all_values, at_texels, brightest, of_values
from neumat.stability.cases import case, refused

VIEWS = (75, 80, 85, 89, 89.9)  # degrees; captures of random queries end at 85, measured BTFs at 75
FEW = 4  # pictures at a view
VIEWED = 9  # views, under as many lights, of what all representations are fitted to
HORIZON = "`Representation.eval`"


def input_cases(bench):
    """Yield the stresses of what the representations of a BtfBench may be asked and fitted to."""
    fitted = functools.cache(lambda name: bench.fitted(bench.grid(VIEWED), name))
    yield from _directions(bench, fitted)
    yield from _broken_features(bench, fitted)
    yield from _broken_stores(bench)


def _directions(bench, fitted):
    def grazing(model, store):
        means, bright = [], 0.0
        light = bench.random_pairs(bench.queries, math.radians(75))[0]
        for theta in VIEWS:
            phi = 2 * math.pi * torch.arange(bench.queries) / bench.queries
            values = at_texels(model, light, spherical(torch.full_like(phi, math.radians(theta)), phi))
            means.append(values.mean().item())
            bright = max(bright, values.max().item() / brightest(store))
        ratios = ", ".join(f"{mean / means[0]:.2f}" for mean in means[1:])
        found = f"mean {ratios} of that at {VIEWS[0]} degrees; brightest {bright:.2f} times the captured"
        finite = math.isfinite(sum(means) + bright)
        return found, finite and bright <= 1.01 and all(0.3 < mean / means[0] < 3 for mean in means)

    asked = ", ".join(f"{theta:g}" for theta in VIEWS)
    expectation = "finite, not brighter than captured, the mean 0.3 to 3 times that at 75 degrees"

    def beside_captured():
        views = torch.tensor(VIEWS[:3]).deg2rad()
        ratios = []
        for theta in views:
            light = bench.random_pairs(FEW, math.radians(75))[0]
            phi = 2 * math.pi * torch.arange(FEW) / FEW
            truth = bench.pictures(light, spherical(theta.expand(FEW), phi))
            ratios.append(bench.brightness(bench.ours, truth, shown=True))
        found = ", ".join(f"{ratio:.2f}" for ratio in ratios)
        return f"{found} times as bright as captured", all(0.7 < ratio < 1.4 for ratio in ratios)

    yield case(f"views at {', '.join(map(str, VIEWS[:3]))} degrees beside captured ones", "mean brightness of pictures "
               "as they are shown 0.7 to 1.4 times that of captured ones", "queries are captured up to 85 degrees",
               beside_captured)  # fmt: skip
    yield case(f"views at {asked} degrees: ours, queries up to 85", expectation, CEILING,
               lambda: grazing(bench.ours, bench.base))  # fmt: skip
    for name in REPRESENTATIONS:
        yield case(f"views at {asked} degrees: {name}, pictures up to 75", expectation, CEILING,
                   lambda name=name: grazing(fitted(name), bench.grid(VIEWED)))  # fmt: skip

    def dark(light, view):
        wrong = [name for name in REPRESENTATIONS if not (at_texels(fitted(name), light, view) == 0).all()]
        return f"otherwise in {', '.join(wrong) or 'none'} of {len(REPRESENTATIONS)}", not wrong

    below = random_directions(bench.queries, torch_generator(bench.seed, "below"), math.pi / 2) * torch.tensor(
        [1.0, 1, -1]
    )
    below[0] = torch.tensor([1.0, 0, 0])
    up = torch.tensor([[0.0, 0, 1]]).expand(bench.queries, 3)
    yield case("lights at and below the horizon", "exactly 0 for all representations", HORIZON,
               lambda: dark(below, up))  # fmt: skip
    yield case("views at and below the horizon", "exactly 0 for all representations", HORIZON,
               lambda: dark(up, below))  # fmt: skip

    def one_nan():
        light, view = bench.random_pairs(bench.queries, math.radians(75))
        wrong = []
        for name in REPRESENTATIONS:
            right, broken = at_texels(fitted(name), light, view), light.clone()
            broken[7] = math.nan
            found = at_texels(fitted(name), broken, view)
            rest = torch.arange(bench.queries) != 7
            if not torch.equal(found[rest], right[rest]) or (found[7] != 0).any():
                wrong.append(name)
        return f"otherwise in {', '.join(wrong) or 'none'} of {len(REPRESENTATIONS)}", not wrong

    yield case("NaN in the light of one query", "0 there, no other query changed, for all representations",
               HORIZON, one_nan)  # fmt: skip


def _broken_features(bench, fitted):
    def wild(factor):
        light, view = bench.random_pairs(bench.queries, math.radians(85))
        generator, wrong = torch_generator(bench.seed, "corners"), []
        for name in REPRESENTATIONS:
            rows = fitted(name).positional().flatten(0, 1)
            low, high = rows.amin(0), rows.amax(0)
            corner = torch.rand(bench.queries, rows.shape[1], generator=generator) < 0.5
            values = fitted(name).eval(factor * torch.where(corner, low, high), light, view)
            bright = values.max().item() / brightest(bench.grid(VIEWED))
            if not (values.isfinite().all() and bright <= 1.01):
                wrong.append(f"{name} ({bright:.2g} times the brightest)")
        return f"otherwise in {', '.join(wrong) or 'none'} of {len(REPRESENTATIONS)}", not wrong

    for factor in (1, 10):
        where = f"{factor} times the " if factor > 1 else ""
        yield case(f"features at {where}ends of their ranges", "finite, not brighter than captured, for all "
                   "representations", CEILING, lambda factor=factor: wild(factor))  # fmt: skip


def _broken_stores(bench):
    def broken(value):
        values = all_values(bench.grid(VIEWED))
        values[3, 1, 2, 0] = value
        return values

    def write(value):
        store, path = bench.grid(VIEWED), bench.folder / "broken.h5"
        blocks = [broken(value)]
        write_btf(path, store.light, store.view, store.height, store.width, blocks, **attributes(store))
        return "written", False

    def read():
        store, path = bench.grid(VIEWED), bench.folder / "damaged.h5"
        write_btf(path, store.light, store.view, store.height, store.width, [all_values(store)], **attributes(store))
        with h5py.File(path, "r+") as file:
            file["values"][3, 1, 2, 0] = math.nan
        return accepted(bench.fitted(read_btf(path)))

    for value in (math.nan, math.inf, -1.0):
        yield refused(f"{value} in a capture that is written", "finite values of at least 0", "`store.write_btf`",
                      lambda value=value: write(value))  # fmt: skip
    yield refused("nan in a store that is read", "finite values", "`BtfStore.values`", read)

    def fit(name):
        return accepted(bench.fitted(of_values(bench.grid(VIEWED), broken(math.nan)), name))

    for name in REPRESENTATIONS:
        yield refused(f"nan in values in memory that {name} is fitted to", "finite values", "`Encoding.checked`",
                      lambda name=name: fit(name))  # fmt: skip
