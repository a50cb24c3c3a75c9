"""Where rendering breaks: many random directions, the largest deviation named. See `stability.rendering`."""

import numpy as np
import torch
from torch.nn.functional import normalize

from neumat.brdf.coordinates import grid_angles
from neumat.fields.field import evaluate
from neumat.seeds import numpy_generator
from neumat.stability.render_bench import CLOSE, QUERIES, degrees, deviation, numbers, off_seam, reference
from neumat.stability.stress import UNNEEDED, Answer, Stress

FIT = 0.02  # mean |log(1 + f) - log(1 + f')| of a field and its table


def query_stresses(bench):
    """Yield every Stress of many random directions."""
    yield from _reciprocity(bench)
    yield from _queries(bench)


def _reciprocity(bench):
    def both_ways(kind, program):
        worst = {}
        for name in bench.materials if kind == "field" else (bench.matte, bench.mirror):
            plugin, material = bench.both(name, kind)
            wi, wo = bench.pairs("reciprocity", bench.queries // len(bench.materials))
            if program == "torch":
                wi, wo = normalize(wi.double()), normalize(wo.double())
                (there, angles), (back, _) = (reference(material, *pair) for pair in ((wi, wo), (wo, wi)))
                there, back = there[off_seam(angles)], back[off_seam(angles)]
            else:
                there, back = (bench.reflectance(plugin, *pair) for pair in ((wi, wo), (wo, wi)))
            worst[name] = deviation(there, back).max().item()
        name = max(worst, key=worst.get)
        found = f"{len(wi)} pairs, {len(worst)} materials: at most {worst[name]:.1g} (1 + f) ({name})"
        return Answer(found, worst[name] <= (1e-9 if program == "torch" else 0))

    for kind in ("field", "table"):
        yield Stress(f"view and light swapped: {kind}, Dr.Jit", "the same to the last bit", (UNNEEDED,),
                     lambda kind=kind: both_ways(kind, "Dr.Jit"))  # fmt: skip
    yield Stress("view and light swapped: field, torch", "the same to 1e-9 (1 + f) in double precision, "
                 "beside the plane of incidence", (UNNEEDED,),
                 lambda: both_ways("field", "torch"))  # fmt: skip


def _queries(bench):
    for kind in ("field", "table"):
        yield Stress(f"{bench.queries} random queries: {kind}, Dr.Jit against torch", f"the same to {CLOSE:g} (1 + f)",
                     (UNNEEDED,), lambda kind=kind: _against_torch(bench, kind))  # fmt: skip
    yield Stress(f"{QUERIES} random queries: fields against their measured tables", f"the same to {FIT:g} in the mean "
                 "of |log(1 + f) - log(1 + f')|; the largest deviation is named", (UNNEEDED,),
                 lambda: _against_tables(bench))  # fmt: skip


def _against_torch(bench, kind):
    names = list(bench.materials) if kind == "field" else [bench.matte, bench.mirror]
    found = {}
    for name in names:
        plugin, material = bench.both(name, kind)
        wi, wo = bench.pairs(f"against torch {name}", bench.queries // len(names))
        f, angles = reference(material, wi, wo)
        value = bench.reflectance(plugin, wi, wo)
        far = torch.where(off_seam(angles), deviation(value, f), 0.0)
        at = far.argmax()
        found[name] = far[at].item(), value[at], f[at], degrees(angles, at)
    name = max(found, key=lambda name: found[name][0])
    far, value, f, where = found[name]
    return Answer(
        f"{len(names)} materials: at most {far:.1g} (1 + f), {name} at {where}: {numbers(value)} against "
        f"{numbers(f)} / sr",
        far < CLOSE,
    )


def _against_tables(bench):
    """Compare every field with its measured table at random valid entries of the grid."""
    each, entries = QUERIES // len(bench.names), bench.store.entries
    means, logs, values = [], {}, {}
    for name, index, weights in zip(bench.names, bench.indices, bench.weights, strict=True):
        positions = np.sort(numpy_generator(bench.seed, "entries", name).integers(len(entries), size=each))
        angles = grid_angles(entries[positions])
        table, f = torch.from_numpy(bench.store.values(index, positions)), evaluate(weights[None], *angles)[0]
        log = (table.log1p() - f.log1p()).abs()
        means.append(log.mean().item())
        for largest, far in ((logs, log), (values, (table - f).abs())):
            at = far.amax(1).argmax()
            largest[far[at].max().item()] = (
                f"{name} at {degrees(angles, at)}: {numbers(f[at])} against {numbers(table[at])} / sr measured"
            )
    return Answer(
        f"{len(means)} materials at {each} valid entries each: {np.mean(means):.2g} in the mean; at most "
        f"{max(logs):.2g}, {logs[max(logs)]}; farthest in f, by {max(values):.3g}, {values[max(values)]}",
        bool(np.mean(means) < FIT),  # NaN is not below it
    )
