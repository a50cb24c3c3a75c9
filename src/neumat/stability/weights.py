"""Where rendering breaks: weights and tables with NaN, half-precision numbers. See `stability.rendering`."""

import math

import h5py
import numpy as np
import torch

from neumat.brdf.coordinates import ENTRIES
from neumat.brdf.merl import write_merl
from neumat.export import export, read_material
from neumat.export.npy import MEMBERS, SUFFIX
from neumat.export.parts import split
from neumat.fields.field import evaluate_inputs
from neumat.render.mitsuba_scene import bsdf
from neumat.render.scene import to_srgb8
from neumat.stability.materials import HUGE
from neumat.stability.render_bench import constant, finite, numbers
from neumat.stability.stress import UNNEEDED, Answer, Stress, refused


def weight_stresses(bench):
    """Yield the Stress of everything that is no field, and of half precision."""
    yield from _broken(bench)
    yield from _half(bench)


def _broken(bench):
    for word, number in (("NaN", math.nan), ("infinity", math.inf)):
        weights = bench.materials[bench.matte].clone()
        weights[5] = number
        for name, run in {
            f"{word} in the text of weights": lambda w=weights: _loaded(bench, bsdf(w)),
            f"{word} in a file of weights": lambda w=weights: read_material(_written(bench.folder / "nan_fc1.npy", w)),
            f"{word} in a store of weights": lambda w=weights: _loaded(bench, _stored(bench.folder / "nan.h5", w)),
            f"{word} in an update of mi.traverse": lambda w=weights: _updated(bench, w),
            f"{word} exported": lambda w=weights: export(w, "npy", bench.folder, "nan"),
        }.items():
            yield refused(name, "finite", run)
    huge = 3e38 * bench.materials[bench.mirror].sign()
    yield refused("weights of 3e38, whose sums overflow", "at most 1e+09", lambda: _loaded(bench, bsdf(huge)))
    for word, number in (("NaN", math.nan), ("infinity", math.inf)):
        yield refused(f"table of {word}", "finite", lambda number=number: _loaded(bench, _filled(bench, number)))
    for count in (674, 676):
        yield refused(
            f"{count} weights in the text", "675 numbers", lambda count=count: _loaded(bench, bsdf(torch.ones(count)))
        )
        if bench.compiled:  # in scalar variants Mitsuba itself compares the numbers with those before, and refuses
            yield refused(f"{count} weights in an update of mi.traverse", "675 finite numbers",
                          lambda count=count: _updated(bench, torch.ones(count)))  # fmt: skip


def _loaded(bench, plugin):
    """Answer that a broken plugin has loaded, and what it gives."""
    return _given(bench, bench.load(plugin))


def _given(bench, plugin):
    value, _ = bench.evaluate(plugin, *bench.pairs("broken", 16))
    return Answer(f"loaded; values {numbers(value[0])}", False)


def _updated(bench, weights):
    plugin = bench.load(bench.materials[bench.matte])
    parameters = bench.mi.traverse(plugin)
    parameters["weights"] = type(parameters["weights"])(weights.numpy())
    parameters.update()
    return _given(bench, plugin)


def _written(path, weights, dtype=np.float32):
    """Write a set of .npy files without the checks of `export`, and return the path of its first."""
    for part, member in zip(split(weights), MEMBERS, strict=True):
        np.save(path.with_name(path.name.replace(SUFFIX, f"_{member}.npy")), part.astype(dtype))
    return path


def _stored(path, weights):
    """Return the plugin of the only sample in a store of samples at `path`, which is written."""
    with h5py.File(path, "w") as file:
        file["samples"] = weights[None].numpy()
    return {"type": "nbrdf", "filename": str(path), "material": "sample-0"}


def _filled(bench, number):
    path = bench.folder / "filled.binary"
    write_merl(path, np.full((ENTRIES, 3), number))
    return {"type": "merl", "filename": str(path)}


def _half(bench):
    for name, dtype, psnr in (("float16", torch.float16, 50), ("bfloat16", torch.bfloat16, 30)):
        yield Stress(f"weights rounded to {name}", f"finite; pictures to {psnr} dB in the median", (UNNEEDED,),
                     lambda dtype=dtype, psnr=psnr: _rounded(bench, dtype, psnr))  # fmt: skip
        yield Stress(f"evaluated in {name}", f"finite; pictures to {psnr} dB in the median", (UNNEEDED,),
                     lambda dtype=dtype, psnr=psnr: _evaluated(bench, dtype, psnr))  # fmt: skip
    yield Stress("field of 1e5 / sr in float16", "of weights f to 1%; of values infinity, as float16 ends at 65504",
                 (UNNEEDED,), lambda: _bright_half())  # fmt: skip
    yield Stress("file of float16 weights", "read as float32, exactly", (UNNEEDED,), lambda: _half_file(bench))


def _rounded(bench, dtype, psnr):
    weights = torch.stack(list(bench.materials.values()))
    return _compared(bench, evaluate_inputs(weights.to(dtype).float(), bench.frozen.inputs.T), psnr)


def _evaluated(bench, dtype, psnr):
    weights = torch.stack(list(bench.materials.values()))
    return _compared(bench, evaluate_inputs(weights.to(dtype), bench.frozen.inputs.T.to(dtype)).float(), psnr)


def _compared(bench, values, psnr):
    """Answer how far values (materials, queries, 3) of the sphere's queries are from those of float32, and their
    pictures."""
    weights = torch.stack(list(bench.materials.values()))
    expected = evaluate_inputs(weights, bench.frozen.inputs.T)
    names, far = list(bench.materials), ((values - expected).abs() / (1 + expected)).flatten(1).amax(1)
    pictures, ours = (to_srgb8(bench.frozen.pictures(f.mT)).double() for f in (values, expected))
    errors = (pictures - ours).square().flatten(1).mean(1)
    decibels = 10 * torch.log10(255**2 / errors.clamp_min(1e-2))
    worst = int(decibels.argmin())
    infinite = (~values.isfinite()).double().mean()
    return Answer(
        f"{len(names)} materials: {infinite:.2%} of values not finite, at most {far.max():.2g} (1 + f) off "
        f"({names[far.argmax()]}); pictures {decibels.median():.1f} dB in the median, at least {decibels.min():.1f} "
        f"({names[worst]})",
        finite(values) and bool(decibels.median() > psnr),
    )


def _bright_half():
    weights, inputs = constant(HUGE)[None], torch.zeros(1, 6)
    rounded = (evaluate_inputs(weights.half().float(), inputs) / HUGE - 1).abs().max().item()
    value = evaluate_inputs(weights.half(), inputs.half()).max().item()
    return Answer(f"of weights off by {rounded:.2%}; of values {value}", rounded < 0.01 and value == math.inf)


def _half_file(bench):
    weights = bench.materials[bench.mirror]
    read = read_material(_written(bench.folder / "half_fc1.npy", weights, np.float16))
    same = read.dtype == torch.float32 and torch.equal(read, weights.half().float())
    return Answer("exact" if same else f"off by {(read - weights.half()).abs().max():.2g}", same)
