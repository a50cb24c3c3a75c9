"""Which directions a scene asks its materials for, and how much each query matters to the picture.

A few paths a pixel are traced through the scene as Mitsuba's `path` integrator would (next event estimation and BSDF
sampling, by the balance heuristic), and every query of a material is kept with all that multiplies it. So the picture
can be computed again with other materials (`replay`), and differentiated by each queried value (`importance`).
"""

from dataclasses import dataclass

import numpy as np
import torch

from neumat.render.mitsuba_scene import mitsuba
from neumat.scenes.compose import BLACK, MAX_DEPTH, surface, units

TINY = 1e-30


@dataclass(frozen=True)
class Queries:
    """What one vertex of the paths asks one unit for: q queries.

    path (q,): which path; angles: theta_h, theta_d, phi_d, each (q,), radians; factor (q, 3): what the value, 1/sr, is
    multiplied by on its way to the light (`Vertex.lit`) or to the next vertex (`Vertex.onward`).
    """

    path: torch.Tensor
    angles: tuple
    factor: torch.Tensor


@dataclass(frozen=True)
class Vertex:
    """lit, onward: {unit: Queries}; met (n, 3): radiance of the light that the way onward meets."""

    lit: dict
    onward: dict
    met: torch.Tensor


@dataclass(frozen=True)
class Trace:
    """seen (n, 3): radiance of lights in direct view; vertices: of the paths, [Vertex]; first (n,): the position of the
    object in direct view among the layout's, -1 for none. Paths are ordered by pixel, `samples` to each."""

    seen: torch.Tensor
    vertices: list
    first: torch.Tensor
    height: int
    width: int
    samples: int

    def picture(self, radiance):
        """Return the linear picture (height, width, 3) of the paths' radiance (n, 3)."""
        return radiance.view(self.height, self.width, self.samples, 3).mean(2)

    def coverage(self, index):
        """Return the share (height, width) of each pixel that object `index` covers."""
        return (self.first == index).float().view(self.height, self.width, self.samples).mean(2)


def trace(composition, layout, samples, seed=0):
    """Return the Trace of `samples` paths a pixel of a Composition of the layout.

    In compiled variants of Mitsuba all paths are traced at once, in scalar ones one after the other.
    """
    paths = _Paths(composition, layout, _probes(layout))
    batches = [paths.follow(*start) for start in paths.starts(samples, seed)]
    first, seen, *vertices = zip(*batches, strict=True)
    return Trace(
        torch.from_numpy(np.concatenate(seen, 1).T.copy()),
        [_vertex(batch) for batch in vertices],
        torch.from_numpy(np.concatenate(first)),
        composition.height,
        composition.width,
        samples,
    )


def coverage(composition, layout):
    """Return {object: share (height, width) of each pixel of a Composition that it covers}, of 4 rays a pixel."""
    samples, paths = 4, _Paths(composition, layout, {})
    found = np.concatenate([np.atleast_1d(np.array(paths.camera(*start)[1])) for start in paths.starts(samples, 0)])
    found = found.reshape(composition.height, composition.width, samples)
    return {name: (found == k).mean(2) for k, name in enumerate(layout["objects"])}


def _vertex(batches):
    """Return the Vertex of batches of paths, [(lit, onward, met)], in order."""
    lit, onward, met = zip(*batches, strict=True)
    sizes = np.array([part.shape[1] for part in met])
    starts = np.cumsum(sizes) - sizes

    def joined(parts):
        answers = {}
        for start, part in zip(starts, parts, strict=True):
            for unit, (asked, angles, factor) in part.items():
                where = np.flatnonzero(asked)
                answers.setdefault(unit, []).append((start + where, angles[:, where], factor[:, where]))
        return {unit: _gathered(*zip(*found, strict=True)) for unit, found in answers.items()}

    return Vertex(joined(lit), joined(onward), torch.from_numpy(np.concatenate(met, 1).T.copy()))


def _gathered(path, angles, factor):
    """Return the Queries of batches of (path (q,), angles (3, q), factor (3, q))."""
    path, angles, factor = (torch.from_numpy(np.concatenate(parts, -1)) for parts in (path, angles, factor))
    return Queries(path, tuple(angles), factor.T.contiguous())


class _Paths:
    """Follows paths through a scene; the same lines for one path (scalar variants) and for all (compiled ones)."""

    def __init__(self, composition, layout, probes):
        self.mi, self.scene = mitsuba(), composition.scene
        self.width, self.height = composition.width, composition.height
        self.objects = list(layout["objects"])
        self.meshes = [composition.meshes[name] for name in self.objects]
        self.probes = probes

    def starts(self, samples, seed):
        """Return [(sampler, pixel)]: of all paths at once, or one after the other."""
        import drjit as dr

        count = self.width * self.height * samples
        sampler = self.mi.load_dict({"type": "independent"})
        if dr.is_jit_v(self.mi.Float):
            sampler.seed(seed, count)
            return [(sampler, dr.arange(self.mi.UInt32, count) // samples)]
        sampler.seed(seed, 1)
        return [(sampler, index // samples) for index in range(count)]

    def camera(self, sampler, pixel):
        """Return what a ray through the pixel meets, a SurfaceInteraction3f, and the object that is."""
        mi = self.mi
        corner = mi.Point2f(mi.Float(pixel % self.width), mi.Float(pixel // self.width))
        film = (corner + sampler.next_2d()) / mi.Point2f(self.width, self.height)
        ray, _ = self.scene.sensors()[0].sample_ray_differential(0.0, sampler.next_1d(), film, mi.Point2f(0.5))
        si = self.scene.ray_intersect(ray)
        return si, self._object(si)

    def follow(self, sampler, pixel):
        """Return first (n,), seen (3, n), then of each vertex (lit, onward, met (3, n)), as arrays.

        lit, onward: {unit: (asked (n,), angles (3, n), factor (3, n))}.
        """
        import drjit as dr

        mi, scene = self.mi, self.scene
        context = mi.BSDFContext()
        si, first = self.camera(sampler, pixel)
        seen = self._emitted(si, True)
        found, active = first, first >= 0
        vertices = []
        for _ in range(MAX_DEPTH - 1):
            # The light that Mitsuba's path integrator would sample, by the balance heuristic.
            light, radiance = scene.sample_emitter_direction(si, sampler.next_2d(), True, active)
            wo = si.to_local(light.d)
            sampled = sampler.next_1d(), sampler.next_2d()
            density, sample, value = self._bsdf(si, context, wo, sampled, active)
            share = dr.select(light.delta, 1.0, light.pdf / dr.maximum(light.pdf + density, TINY))
            lit = self._queries(context, si, wo, active & (light.pdf > 0), found, radiance * share)

            active = active & (sample.pdf > 0) & (dr.max(value) > 0)
            passed = mi.Color3f(1 / dr.maximum(sample.pdf, TINY))
            onward = self._queries(context, si, sample.wo, active, found, passed)
            before, si = si, scene.ray_intersect(si.spawn_ray(si.to_world(sample.wo)), active)
            met = self._emitted(si, active)
            hit = active & (dr.max(met) > 0)
            # In scalar variants, what isn't a light has no density to ask for.
            light = mi.DirectionSample3f(scene, si, before)
            chosen = 0.0 if hit is False else scene.pdf_emitter_direction(before, light, hit)
            met = dr.select(hit, met * (sample.pdf / dr.maximum(sample.pdf + chosen, TINY)), mi.Color3f(0.0))
            found = self._object(si)
            if dr.is_jit_v(mi.Float):
                sampler.schedule_state()
                dr.eval(lit, onward, met, si, found, active)
            vertices.append((_arrays(lit), _arrays(onward), _colours(met)))
            active = active & (found >= 0)
        return np.atleast_1d(np.array(first)), _colours(seen), *vertices

    def _bsdf(self, si, context, wo, sampled, active):
        """Return the density of the direction wo, and a direction sampled, as a BSDFSample3f and its weight."""
        mi = self.mi
        bsdf = None if si.shape is None else si.bsdf()
        if bsdf is None:  # in scalar variants, where nothing was met
            return 0.0, mi.BSDFSample3f(), mi.Color3f(0.0)
        density = bsdf.pdf(context, si, wo, active)
        return density, *bsdf.sample(context, si, *sampled, active)

    def _emitted(self, si, active):
        """Return the radiance of the light that a ray met."""
        import drjit as dr

        emitter = si.emitter(self.scene, active)
        if dr.is_jit_v(self.mi.Float):
            return dr.select(active, emitter.eval(si, active), self.mi.Color3f(0.0))
        return emitter.eval(si) if active and emitter is not None else self.mi.Color3f(0.0)

    def _object(self, si):
        """Return the position of the object that a ray met, -1 for none of the layout's."""
        import drjit as dr

        mi = self.mi
        if not dr.is_jit_v(mi.Float):
            return next((k for k, mesh in enumerate(self.meshes) if si.is_valid() and si.shape == mesh), -1)
        found = mi.Int32(-1)
        for k, mesh in enumerate(self.meshes):
            found = dr.select(si.is_valid() & (si.shape == mi.ShapePtr(mesh)), k, found)
        return found

    def _queries(self, context, si, wo, active, found, factor):
        """Return {unit: (asked, angles, factor)} of a vertex and a direction, the angles as a colour."""
        import drjit as dr

        answers = {}
        for (name, k), (angles, cosine) in self.probes.items():
            here = active & (found == self.objects.index(name))
            if here is False:
                continue
            # The surface around the probe turns directions, and multiplies what it says by the share of its material.
            turned, told = angles.eval(context, si, wo, here), cosine.eval(context, si, wo, here)
            asked = here & (told.y > 0)
            answers[name, k] = asked, turned / dr.maximum(told.y, TINY), factor * told.x
        return answers


def _probes(layout):
    """Return {unit: (BSDF, BSDF)}: the objects' surfaces with a unit that answers with its query's angles, and with
    (cosine of the direction of the light, 1, 0); the other materials of its object are black."""
    mi = mitsuba()
    import drjit as dr

    from neumat.render.drjit_brdf import half_difference

    class Probe(mi.BSDF):
        def __init__(self, properties):
            mi.BSDF.__init__(self, properties)
            self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]
            self.angles = properties["angles"]

        def eval(self, context, si, wo, active=True):
            active = active & (si.wi.z > 0) & (wo.z > 0)
            if self.angles:
                sin_h, cos_h, (x, y, z) = half_difference(si.wi, wo)
                told = dr.atan2(sin_h, cos_h), dr.atan2(dr.sqrt(x * x + y * y), z), dr.atan2(y, x)
            else:
                told = wo.z, 1.0, 0.0
            return dr.select(active, mi.Color3f(*told), mi.Color3f(0.0))

        # No path is sampled by a probe, but compiled variants compile all BSDFs that exist.
        def sample(self, context, si, sample1, sample2, active=True):
            return dr.zeros(mi.BSDFSample3f), mi.Color3f(0.0)

        def pdf(self, context, si, wo, active=True):
            return mi.Float(0.0)

        def eval_pdf(self, context, si, wo, active=True):
            return self.eval(context, si, wo, active), mi.Float(0.0)

    mi.register_bsdf("neumat_probe", Probe)

    def probed(item, k, angles):
        parts = [BLACK] * len(item["materials"])
        parts[k] = {"type": "neumat_probe", "angles": angles}
        return mi.load_dict(surface(item, parts))

    return {
        (name, k): tuple(probed(layout["objects"][name], k, angles) for angles in (True, False))
        for name, k in units(layout)
    }


def _colours(colours):
    return np.array(colours, np.float32).reshape(3, -1)


def _arrays(answers):
    return {
        unit: (np.atleast_1d(np.array(asked)), _colours(angles), _colours(factor))
        for unit, (asked, angles, factor) in answers.items()
    }
