"""Where rendering breaks: directions, values and files at their limits, and which guard catches what.

Every stress says what must happen; what does happen stands beside it, measured. Here are the directions; the
materials are in `stability.materials`, broken and coarse numbers in `stability.weights`, and comparisons at many random
directions in `stability.queries`.
"""

import math

import numpy as np
import torch
from torch.nn.functional import normalize

from neumat.brdf.coordinates import cosines
from neumat.fields.field import Field
from neumat.fields.physics import largest_albedo
from neumat.render.sphere import radiance_fields
from neumat.seeds import torch_generator
from neumat.stability.materials import material_stresses
from neumat.stability.queries import query_stresses
from neumat.stability.render_bench import (
    CLOSE,
    albedo,
    degrees,
    deviation,
    finite,
    material_at,
    numbers,
    off_seam,
    reference,
)
from neumat.stability.stress import UNNEEDED, Answer, Stress, stress_table
from neumat.stability.weights import weight_stresses

ANGLES = (60, 75, 85, 89, 89.9)  # of the view, degrees


def stability_table(bench, progress=iter):
    """Return the `stress_table` of a RenderBench; guards may also be "limited", values that are kept finite."""
    return stress_table(stresses(bench), bench.folder, progress)


def stresses(bench):
    """Yield every Stress of a RenderBench."""
    yield from _grazing(bench)
    yield from material_stresses(bench)
    yield from weight_stresses(bench)
    yield from _odd_directions(bench)
    yield from query_stresses(bench)


def _grazing(bench):
    for theta in ANGLES:
        for kind in ("field", "table"):
            yield Stress(f"view at {theta} degrees: {kind}", f"finite, as in torch to {CLOSE:g} (1 + f); drawn "
                         "directions unbiased", (UNNEEDED,),
                         lambda theta=theta, kind=kind: _view(bench, theta, kind))  # fmt: skip
    yield Stress("view beyond 85 degrees, with conserve", "reflects no more than arrives", (UNNEEDED,),
                 lambda: _conserved(bench))  # fmt: skip
    yield Stress("edge of a sphere", "finite pixels, 0 or more, as bright in the mean as the sphere renderer's to "
                 f"{bench.noise:.0%}", (UNNEEDED,), lambda: _edge(bench))  # fmt: skip


def _view(bench, theta, kind):
    names = bench.materials if kind == "field" else (bench.matte, bench.mirror)
    far, drawn, right = {}, {}, True
    for name in names:
        plugin, material = bench.both(name, kind)
        wi, wo = bench.pairs(f"view at {theta}", bench.draws, theta)
        value, density = bench.evaluate(plugin, wi, wo)
        f, angles = reference(material, wi, wo)
        far[name] = deviation(value / wo[:, 2:], f)[off_seam(angles)].max().item()
        drawn[name] = bench.drawn(plugin, material, theta)
        right &= finite(value, density) and bool((value >= 0).all() and (density > 0).all()) and drawn[name].right
    farthest, worst = max(far, key=far.get), max(drawn, key=lambda name: drawn[name].error)
    return Answer(
        f"{len(far)} materials: at most {far[farthest]:.1g} (1 + f) from torch ({farthest}); {bench.draws} drawn "
        f"directions reflect up to {max(each.share for each in drawn.values()):.3g} of the light, at most "
        f"{drawn[worst].error:.1%} off the quadrature ({worst})",
        right and far[farthest] < CLOSE,
    )


def _conserved(bench):
    angles, found = (86, 87, 88, 89, 89.9), {}
    for name, weights in zip(bench.names, bench.weights, strict=True):
        shares = [albedo(weights, theta).max().item() for theta in angles]
        found[name] = max(shares), angles[int(np.argmax(shares))], max(shares) / max(1, largest_albedo(Field(weights)))
    plain, conserved = (max(found, key=lambda name: found[name][i]) for i in (0, 2))
    return Answer(
        f"{len(found)} fields: at most {found[plain][0]:.3g} of the light without conserve ({plain}, view at "
        f"{found[plain][1]} degrees), {found[conserved][2]:.3g} with it ({conserved})",
        found[conserved][2] <= 1,
    )


def _edge(bench):
    coverage = bench.frozen.coverage.view(bench.size, bench.size)
    edge = (coverage > 0) & (coverage < 1)
    found, right = [], True
    for name in (bench.matte, bench.mirror):
        theirs, ours = bench.picture(bench.materials[name]), radiance_fields(bench.frozen, bench.materials[name][None])
        ratio = float(theirs.mean() / ours.mean())
        right &= finite(theirs, ours) and bool((theirs >= 0).all()) and abs(ratio - 1) < bench.noise
        found.append(f"{name} {ratio:.3f} times as bright, at the edge up to {float(theirs[edge].max()):.3g}")
    return Answer(f"{int(edge.sum())} pixels at the edge: {'; '.join(found)}", right)


def _odd_directions(bench):
    wi, wo = bench.pairs("odd", bench.draws)
    down = torch.tensor([1.0, 1.0, -1.0])
    grazing = torch.tensor([math.sin(math.radians(89.9)), 0.0, math.cos(math.radians(89.9))])
    normal = torch.tensor([[0.0, 0.0, 1.0]])
    nearly = torch.cat([normalize(normal + torch.tensor([10.0**-k, 0, 0])) for k in range(3, 9)])
    for name, pair in {
        "view and light the same": (wi, wi),
        "view and light along the normal": (normal, normal),
        "mirror direction at 89.9 degrees": (grazing[None], grazing[None] * torch.tensor([-1.0, 1, 1])),
        "half vector 1e-3 to 1e-8 from the normal": (normal.expand(6, 3), nearly),
        "exactly in the plane of incidence": (
            normalize(wi * torch.tensor([1.0, 0, 1])), normalize(wo * torch.tensor([1.0, 0, 1]))),
    }.items():  # fmt: skip
        yield Stress(name, f"finite, as in torch to {CLOSE:g} (1 + f)", (UNNEEDED,),
                     lambda pair=pair: _as_torch(bench, *pair))  # fmt: skip
    yield Stress("either side of the plane of incidence", "finite; how far f jumps where phi_d wraps", (UNNEEDED,),
                 lambda: _step(bench))  # fmt: skip
    for name, pair in {
        "light below the horizon": (wi, wo * down),
        "view below the horizon": (wi * down, wo),
        "both below the horizon": (wi * down, wo * down),
        "view from straight below": (-normal.expand_as(wo), wo),
        "light opposite to the view": (wi, -wi),
        "light on the horizon": (wi, normalize(wo * torch.tensor([1.0, 1, 0]))),
        "directions of length 0": (wi * 0, wo * 0),
        "directions that are NaN": (wi, wo * math.nan),
    }.items():
        yield Stress(name, "value and density 0", (UNNEEDED,), lambda pair=pair: _nothing(bench, *pair))
    # The plugin does not normalise: one more rounding moves a mirror's values at 89.9 degrees 100 times as far.
    for factor in (0.5, 2, 1e-3, 1e3):
        yield Stress(f"directions of length {factor:g}", "finite, 0 or more; f is right for unit "
                     "vectors only", (UNNEEDED,),
                     lambda factor=factor: _scaled(bench, wi, wo, factor))  # fmt: skip


def _as_torch(bench, wi, wo):
    found, right = {}, True
    for name, kind in ((bench.matte, "field"), (bench.mirror, "field"), (bench.mirror, "table")):
        plugin, material = bench.both(name, kind)
        value, density = bench.evaluate(plugin, wi, wo)
        f, angles = reference(material, wi, wo)
        # In the plane of incidence phi_d is rounded to either of its ends, and both are right.
        ends = torch.where(angles[2] < 1, math.pi - 1e-6, 1e-6)
        other = material_at(material, *angles[:2], ends)
        far = torch.minimum(*(deviation(value / wo[:, 2:], g) for g in (f, other))).max().item()
        right &= finite(value, density) and bool((value >= 0).all()) and far < CLOSE
        found[f"{name} ({kind})"] = far
    return Answer("from torch: " + ", ".join(f"{name} {far:.1g}" for name, far in found.items()) + " (1 + f)", right)


def _step(bench):
    """Measure how far f jumps over the plane of incidence, where phi_d wraps from pi to 0: over all fields."""
    generator = torch_generator(bench.seed, "step")
    theta_h, theta_d = math.pi / 2 * torch.rand(2, bench.draws, generator=generator, dtype=torch.float64)
    sides = [torch.full_like(theta_h, phi_d) for phi_d in (1e-6, math.pi - 1e-6)]
    lit = torch.stack([(torch.stack(cosines(theta_h, theta_d, phi_d)) > 0).all(0) for phi_d in sides]).all(0)
    theta_h, theta_d, sides = theta_h[lit], theta_d[lit], [phi_d[lit] for phi_d in sides]
    steps, right = {}, True
    for name, weights in zip(bench.names, bench.weights, strict=True):
        one, other = (material_at(weights, theta_h, theta_d, phi_d) for phi_d in sides)
        right &= finite(one, other)
        far = deviation(one, other)
        at = far.argmax()
        steps[name] = (far[at].item(), far.mean().item(), one[at], other[at], degrees((theta_h, theta_d, sides[0]), at))
    name = max(steps, key=lambda name: steps[name][0])
    far, _, one, other, where = steps[name]
    mean = np.mean([step[1] for step in steps.values()])
    return Answer(
        f"{len(steps)} fields at {len(theta_h)} places: {mean:.2g} (1 + f) in the mean, at most {far:.2g}, {name} at "
        f"{where}: {numbers(one)} beside {numbers(other)} / sr",
        right,
    )


def _nothing(bench, wi, wo):
    right = True
    for kind in ("field", "table"):
        plugin = bench.both(bench.matte, kind)[0]
        value, density = bench.evaluate(plugin, wi, wo)
        right &= bool((value == 0).all() and (density == 0).all())
        # Drawing must not fail either, and from below the surface there is nothing to draw.
        weight = bench.draw(plugin, wi, bench.points("nothing", len(wi)))[2]
        right &= finite(weight[wi[:, 2] > 0]) and bool((weight[~(wi[:, 2] > 0)] == 0).all())
    return Answer(f"{len(wi)} pairs, field and table: {'all 0' if right else 'not all 0'}", right)


def _scaled(bench, wi, wo, factor):
    found, right = [], True
    for kind in ("field", "table"):
        plugin, material = bench.both(bench.mirror, kind)
        value, density = bench.evaluate(plugin, factor * wi, factor * wo)
        weight = bench.draw(plugin, factor * wi, bench.points("scaled", len(wi)))[2]
        right &= finite(value, density, weight) and bool((value >= 0).all() and (density >= 0).all())
        f = bench.reflectance(plugin, factor * wi, factor * wo)
        far = deviation(f, reference(material, wi, wo)[0])
        found.append(f"{kind}: f {far.median():.1g} (1 + f) off in the median, {far.max():.2g} at most")
    return Answer(f"{bench.mirror}, {'; '.join(found)}", right)
