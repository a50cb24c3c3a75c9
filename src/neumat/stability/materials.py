"""Where rendering breaks: materials at their limits. See `stability.rendering`."""

import math

import numpy as np
import torch

from neumat.brdf.coordinates import ENTRIES, above_horizon
from neumat.brdf.merl import read_merl, write_merl
from neumat.brdf.sources import write_sources
from neumat.brdf.table import Table
from neumat.brdf.validity import directional_albedo
from neumat.export import export, read_material
from neumat.fields.field import Field
from neumat.fields.layout import SIZE
from neumat.render.lobes import SAMPLERS, fit_lobes
from neumat.render.mitsuba_scene import bsdf
from neumat.render.quadrature import hemisphere
from neumat.render.scene import BACKGROUND, to_srgb8
from neumat.stability.render_bench import constant, finite, highlight, reference, scaled
from neumat.stability.stress import UNNEEDED, Answer, Stress, refused

LIMITED = "limited"
FEW = 64  # directions
NOISE = 0.15  # relative RMS error of the light that FEW directions say is reflected
HUGE = 1e5  # 1/sr; float16 ends at 65504
SHARP = highlight(0.0, 1e4, 5e3)  # f is half as high at 0.00014 rad; the sharpest lobe's roughness is 0.003


def material_stresses(bench):
    """Yield the Stress of every material."""
    yield from _mirrors(bench)
    yield from _dark(bench)
    yield from _bright(bench)


def _mirrors(bench):
    mirror = bench.materials[bench.mirror]
    for theta in (30, 80):
        yield Stress(f"mirror, {FEW} directions, view at {theta} degrees", f"reflected light to {NOISE:.0%} (RMS), "
                     "unbiased", (UNNEEDED,), lambda theta=theta: _noise(bench, mirror, theta))  # fmt: skip
    yield Stress("mirror sharper than every lobe", "unbiased", (UNNEEDED,), lambda: _sharp(bench))
    yield Stress("sampler all in the sharpest lobe", "density integrates to the share that is drawn above the horizon "
                 "to 2%; the cosine lobe keeps 4%", (UNNEEDED,), lambda: _sharpest(bench))  # fmt: skip
    yield Stress("random numbers 0 and nearly 1", "finite weights; unit directions", (UNNEEDED,),
                 lambda: _corners(bench))  # fmt: skip


def _noise(bench, weights, theta):
    found, right = {}, True
    for sampler in SAMPLERS:
        drawn = bench.drawn(bench.load(bsdf(weights) | {"sampler": sampler}), weights, theta)
        found[sampler] = drawn.spread / math.sqrt(FEW)
        if sampler == "fitted":
            right = drawn.right and found[sampler] < NOISE
            error = drawn.error
    noise = ", ".join(f"{sampler} {value:.2g}" for sampler, value in found.items())
    return Answer(
        f"{bench.mirror}, relative RMS error: {noise}; fitted, {bench.draws} directions: {error:.1%} off", right
    )


def _sharp(bench):
    # The quadrature of other materials would miss this highlight.
    expected = directional_albedo(Field(SHARP), 0.5, 1024)
    drawn = bench.drawn(bench.load(SHARP), SHARP, math.degrees(0.5), expected, 1 << 13)
    return Answer(
        f"{drawn.share:.2g} of the light, {drawn.error:.1%} off; relative RMS error of {FEW} directions "
        f"{drawn.spread / math.sqrt(FEW):.2g}",
        drawn.right,
    )


def _sharpest(bench):
    shares = fit_lobes(Field(SHARP))
    plugin = bench.load(SHARP)
    light, view, weight = hemisphere(torch.tensor([0.5], dtype=torch.float64))
    up = weight[0] > 0
    wi = view.expand(bench.draws, 3)
    above = (bench.draw(plugin, wi, bench.points("sharpest", bench.draws))[1] > 0).double().mean().item()
    density = bench.evaluate(plugin, view.expand(int(up.sum()), 3), light[0][up])[1]
    integral = float((density * weight[0][up] / light[0][up, 2]).sum())
    return Answer(
        f"shares of the sharpest lobe {shares[:, -1].min():.2f} to {shares[:, -1].max():.2f}, of the cosine lobe at "
        f"least {(1 - shares.sum(1)).min():.3f}; density integrates to {integral:.4f}, {above:.4f} drawn above",
        bool(abs(integral - above) < 0.02 and (1 - shares.sum(1)).min() > 0.04),
    )


def _corners(bench):
    ends = torch.tensor([0.0, 0.5, 1 - 2.0**-24])
    points = torch.cartesian_prod(ends, ends)
    found, right = 0.0, True
    for name in (bench.matte, bench.mirror):
        for theta in (0.0, 45.0, 89.9):
            wi = bench.pairs("corners", len(points), theta)[0]
            wo, density, weight = bench.draw(bench.load(bench.materials[name]), wi, points)
            found = max(found, float((wo.norm(dim=1) - 1).abs().max()))
            right &= finite(wo, density, weight)
    return Answer(
        f"{len(points)} points, 2 fields, 3 views: lengths off by at most {found:.1g}", right and found < 1e-4
    )


def _dark(bench):
    for factor in (1e-2, 1e-4, 1e-6):
        yield Stress(f"nearly black: log(1 + f) times {factor:g}",
                     "as in torch to 2e-7 / sr and 1e-5 of the brightest; 0 or more; density above 0", (UNNEEDED,),
                     lambda factor=factor: _nearly_black(bench, factor))  # fmt: skip
    yield Stress("field of 675 zeros", "value exactly 0, density above 0, picture black", (UNNEEDED,),
                 lambda: _black(bench))  # fmt: skip


def _nearly_black(bench, factor):
    far, brightest, right = 0.0, 0.0, True
    for name in (bench.matte, bench.mirror):
        weights = scaled(bench.materials[name], factor)
        plugin = bench.load(weights)
        wi, wo = bench.pairs("dark", bench.draws)
        value, density = bench.evaluate(plugin, wi, wo)
        expected = reference(weights, wi, wo)[0] * wo[:, 2:]
        weight = bench.draw(plugin, wi, bench.points("dark", bench.draws))[2]
        far = max(far, (value - expected).abs().max().item())
        brightest = max(brightest, expected.max().item())
        right &= finite(value, density, weight) and bool((value >= 0).all() and (density > 0).all())
    return Answer(
        f"brightest {brightest:.2g} / sr, at most {far:.1g} / sr from torch", right and far < 2e-7 + 1e-5 * brightest
    )


def _black(bench):
    zeros = torch.zeros(SIZE)
    plugin = bench.load(bsdf(zeros) | {"conserve": True})
    wi, wo = bench.pairs("black", bench.draws)
    value, density = bench.evaluate(plugin, wi, wo)
    weight = bench.draw(plugin, wi, bench.points("black", bench.draws))[2]
    picture = bench.picture(zeros)
    return Answer(
        f"largest value {value.max():g}, weight {weight.max():g}, least density {density.min():.2g} / sr, brightest "
        f"pixel {picture.max():.2g}, where the background is {BACKGROUND}",
        bool((value == 0).all() and (weight == 0).all() and (density > 0).all())
        and float(picture.max()) <= BACKGROUND + 1e-6,
    )


def _bright(bench):
    yield Stress("table of 1e5 / sr everywhere", "1e5 to 1e-5, finite weights, white picture", (UNNEEDED,),
                 lambda: _bright_table(bench))  # fmt: skip
    yield refused("table of 1e5 / sr as a source, which are stored in float16", "at most 65504 / sr",
                  lambda: write_sources({"kind": "merl", "folder": _huge_table(bench).parent},
                                        bench.folder / "s.h5"))  # fmt: skip
    yield Stress("field of 1e5 / sr everywhere", "1e5 to 1e-4, finite weights, white picture; files of weights give it "
                 "back exactly, the MERL table to 1e-6", (UNNEEDED,), lambda: _bright_field(bench))  # fmt: skip
    infinite = constant(1.0)
    infinite[-3:] = 89.0
    yield Stress("field of e^89 / sr, infinite in float32", "a finite value, and no NaN in a picture with dark sides",
                 (LIMITED,), lambda: _overflow(bench, infinite))  # fmt: skip
    yield refused("field of e^89 / sr as a MERL table", "finite values",
                  lambda: export(infinite, "merl", bench.folder, "infinite"))  # fmt: skip


def _huge_table(bench):
    path = bench.folder / "huge" / "huge.binary"
    if not path.exists():
        values = np.full((ENTRIES, 3), np.nan)
        values[above_horizon()] = HUGE
        write_merl(path, values)
    return path


def _bright_table(bench):
    path = _huge_table(bench)
    return _as_bright(bench, {"type": "merl", "filename": str(path)}, Table(read_merl(path)), 1e-5)


def _bright_field(bench):
    weights = constant(HUGE)
    answer = _as_bright(bench, bsdf(weights), weights, 1e-4)
    paths = {format: export(weights, format, bench.folder, "bright") for format in ("npy", "keras", "safetensors")}
    exact = all(torch.equal(read_material(path), weights) for path in paths.values())
    table = read_material(export(weights, "merl", bench.folder, "bright"))
    off = (table.values[table.valid] / HUGE - 1).abs().max().item()
    found = f"{answer.found}; {', '.join(paths)} {'exact' if exact else 'not exact'}, merl to {off:.1g}"
    return Answer(found, answer.right and exact and off < 1e-6)


def _as_bright(bench, plugin, material, most):
    loaded = bench.load(plugin)
    wi, wo = bench.pairs("bright", bench.draws)
    value, density = bench.evaluate(loaded, wi, wo)
    weight = bench.draw(loaded, wi, bench.points("bright", bench.draws))[2]
    lit = (reference(material, wi, wo)[0] > 0).all(1)
    off = (value / (HUGE * wo[:, 2:]) - 1)[lit].abs().max().item()
    picture = bench.picture(plugin)
    middle = to_srgb8(picture[bench.size // 2, bench.size // 2])
    return Answer(
        f"value off by {off:.1g}, weights up to {weight.max():.3g}, middle of the picture {middle.tolist()}",
        finite(value, density, weight, picture) and off < most and bool((middle == 255).all()),
    )


def _overflow(bench, weights):
    wi, wo = bench.pairs("overflow", bench.draws)
    torchs = Field(weights).eval(*reference(weights, wi, wo)[1])
    plugin = bench.load(weights)
    value, _ = bench.evaluate(plugin, wi, wo)
    weight = bench.draw(plugin, wi, bench.points("overflow", bench.draws))[2]
    picture = bench.picture(weights, lambda directions: (directions[..., 1] > 0).float())
    bad = int((~picture.isfinite()).any(-1).sum())
    return Answer(
        f"torch: {(~torchs.isfinite()).any(1).double().mean():.0%} not finite; Mitsuba: up to {value.max():.2g} / sr, "
        f"{bad} pixels not finite",
        finite(value, weight) and not bad and not finite(torchs),
        LIMITED,
    )
