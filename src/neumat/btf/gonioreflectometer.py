"""A virtual gonioreflectometer: paths through the relief of a surface, each with a light and a view of its own.

Compiled variants of Mitsuba only. A path starts far away along the view, towards its point on the plane of mean height.
At each facet that it meets, the light arrives along one direction, irradiance 1 across it, if no other facet is in
between; then the path goes on into a direction drawn from the facet's material. What leaves the relief is lost: the
surroundings are black, and beyond the margin of the relief nothing casts shadows.
"""

import numpy as np
import torch

from neumat.errors import NeumatError
from neumat.render.lobes import fit_lobes
from neumat.render.mitsuba_scene import mitsuba

OFFSET = 2e-5  # sides of the exemplar by which a new ray starts off its facet
STATE = ("active", "depth", "origin", "direction", "throughput", "total", "met")
R2 = (0.7548776662466927, 0.5698402909980532)
LEAST_COSINE = 1e-3  # of a view: rays nearer to the plane than .06 degrees start nearer


class Facets:
    """The materials of a surface in Dr.Jit's memory, shared by all parts of it; tables: [brdf.table.Table]."""

    def __init__(self, tables):
        mi = mitsuba()
        if "scalar" in mi.variant():
            raise NeumatError(mi.variant(), "a compiled variant of Mitsuba, for which LLVM is needed", "none")
        from neumat.render.drjit_brdf import buffer

        self.tables = buffer(torch.cat([torch.cat([t.values, t.valid[:, None]], 1) for t in tables]))
        self.lobes = buffer(torch.cat([fit_lobes(table) for table in tables]))


class Gonioreflectometer:
    """Measures a part of a surface.

    relief: its `Relief`; facets: Facets; rows, columns: ranges of its texels in a picture that is `width` texels wide;
    texels: along a side of the exemplar; bounces: facets that a path meets. A texel's numbers depend on its place in
    the picture, not on the part.
    """

    def __init__(self, relief, facets, rows, columns, width, texels, bounces=3):
        import drjit as dr

        mi = mitsuba()
        self.mi, self.facets, self.rows, self.columns, self.width = mi, facets, rows, columns, width
        self.scene = self._scene(relief)
        vertices = np.stack([relief.heights, relief.slopes_x, relief.slopes_y, relief.materials], -1)
        self.vertices = mi.Float(vertices.astype(np.float32).ravel())
        # What changes from part to part is no constant of the kernel, which would be compiled again.
        self.quads = dr.opaque(mi.UInt32, relief.heights.shape[1] - 1)
        self.step = dr.opaque(mi.Float, relief.step)
        self.top = dr.opaque(mi.Float, float(relief.heights.max()) + relief.step)
        self.texel = dr.opaque(mi.Float, 1 / texels)
        self.bounces = dr.opaque(mi.UInt32, bounces)

    def _scene(self, relief):
        """Return the relief as a mi.Scene of one mesh."""
        mi, faces = self.mi, relief.faces
        mesh = mi.Mesh("relief", relief.heights.size, len(faces))
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mi.Float(relief.positions.ravel())
        parameters["faces"] = mi.UInt32(faces.ravel())
        parameters.update()
        return mi.load_dict({"type": "scene", "relief": mesh})

    def values(self, light, view, keys, samples):
        """Return values (k, rows, columns, 3), float32, 1/sr, the means over `samples` paths a texel; and how many
        paths met no facet from above: they don't count, and a texel of which all are lost is black.

        light, view (k, p, 3): texel t of the whole picture, row by row, belongs to pair t mod p; keys (k,) below 2^32:
        what its random numbers depend on, beside t.
        """
        import drjit as dr

        mi = self.mi
        height, width, pairs = len(self.rows), len(self.columns), light.shape[1]
        count = len(keys) * height * width

        def scalar(number):
            return dr.opaque(mi.UInt32, number)

        path = dr.arange(mi.UInt32, count * samples)
        at, sample = path // scalar(samples), path % scalar(samples)
        picture, at = at // scalar(height * width), at % scalar(height * width)
        row, column = at // scalar(width), at % scalar(width)
        texel = (scalar(self.rows.start) + row) * scalar(self.width) + scalar(self.columns.start) + column
        pair = picture * scalar(pairs) + texel % scalar(pairs)
        light, view = (
            dr.gather(mi.Vector3f, mi.Float(np.ascontiguousarray(array, np.float32).ravel()), pair)
            for array in (light, view)
        )
        key = dr.gather(mi.UInt32, mi.UInt32(np.asarray(keys, np.uint32)), picture)
        random = _Random(mi, key, texel, sample, samples)
        total, met = self._follow(mi.Point2f(mi.Float(column), mi.Float(row)), light, view, random)
        total, met = np.array(total).T.reshape(count, samples, 3), np.array(met).reshape(count, samples)
        mean = total.sum(1) / met.sum(1, dtype=np.float32).clip(1)[:, None]
        return torch.from_numpy(mean).view(len(keys), height, width, 3), int(met.size - np.count_nonzero(met))

    def _follow(self, corner, light, view, random):
        """Return the values, Color3f, of paths through the texels at `corner`, and whether they met the relief."""
        import drjit as dr

        mi = self.mi
        target = (corner + random.point(mi.UInt32(0))) * self.texel
        distance = self.top / dr.maximum(view.z, LEAST_COSINE)
        count = dr.width(target)
        state = (
            dr.full(mi.Bool, True, count),
            dr.zeros(mi.UInt32, count),
            mi.Point3f(mi.Vector3f(target.x, target.y, 0.0) + view * distance),
            -view,
            dr.full(mi.Color3f, 1.0, count),
            dr.zeros(mi.Color3f, count),
            dr.full(mi.Bool, False, count),
        )
        *_, total, met = dr.while_loop(
            state, lambda active, *_: active, lambda *state: self._meet(light, random, *state), labels=STATE
        )
        dr.eval(total, met)
        return total, met

    def _meet(self, light, random, active, depth, origin, direction, throughput, total, met):
        """Return the state of paths, STATE, after the next facet that they meet."""
        import drjit as dr

        from neumat.render import drjit_brdf as brdf

        mi, tables, lobes = self.mi, self.facets.tables, self.facets.lobes

        def reflected(wi, wo, material):
            return brdf.table_value(tables, wi, wo, material) * wo.z

        found = self.scene.ray_intersect_preliminary(mi.Ray3f(origin, direction), coherent=False, active=active)
        active = active & found.is_valid()
        facing, frame, material = self._facet(found, direction, active)
        active = active & (dr.dot(facing, direction) < 0)
        met = met | active
        wi = frame.to_local(-direction)
        beside = mi.Point3f(origin + direction * found.t + facing * OFFSET)

        wo = frame.to_local(light)
        lit = active & (wo.z > 0) & (dr.dot(facing, light) > 0)
        lit = lit & ~self.scene.ray_test(mi.Ray3f(beside, light), coherent=False, active=lit)
        total = total + dr.select(lit, throughput * brdf.called(reflected, lit, wi, wo, material), 0.0)

        depth = depth + 1
        active = active & (depth < self.bounces)
        wo = brdf.lobes_sample(lobes, wi, random.point(depth), material)
        density = brdf.lobes_density(lobes, wi, wo, material)
        onward = frame.to_world(wo)
        active = active & (wo.z > 0) & (density > 0) & (dr.dot(facing, onward) > 0)
        value = brdf.called(reflected, active, wi, wo, material) / dr.select(active, density, 1.0)
        throughput = dr.select(active, throughput * value, throughput)
        return active & (dr.max(throughput) > 0), depth, beside, onward, throughput, total, met

    def _facet(self, found, direction, active):
        """Return the facet's normal, the frame of shading and the material where rays met the relief.

        The normal of shading is that of the vertices; where it turns away from the ray, the facet's. The material is
        that of the nearest vertex.
        """
        import drjit as dr

        mi = self.mi
        quad, second = found.prim_index >> 1, (found.prim_index & 1) == 1
        a = quad + quad // self.quads  # a row has one vertex more than quads
        c = a + self.quads + 1
        first, middle, last = (
            dr.gather(mi.Vector4f, self.vertices, corner, active)
            for corner in (a, dr.select(second, c + 1, a + 1), dr.select(second, c, c + 1))
        )
        along, across = middle.x - first.x, last.x - middle.x  # of the height, the second triangle's the other way
        facing = dr.normalize(
            mi.Vector3f(dr.select(second, across, -along), dr.select(second, first.x - last.x, -across), self.step)
        )
        u, v = found.prim_uv
        smooth = first * (1 - u - v) + middle * u + last * v
        normal = dr.normalize(mi.Vector3f(-smooth.y, -smooth.z, 1.0))
        normal = dr.select(dr.dot(normal, direction) < 0, normal, facing)
        nearest = dr.select(u >= v, dr.select(2 * u + v >= 1, middle.w, first.w), first.w)
        nearest = dr.select((v > u) & (2 * v + u >= 1), last.w, nearest)
        return facing, mi.Frame3f(normal), mi.UInt32(nearest)


class _Random:
    """Points of the unit square that depend on a key, a texel and the number of a sample, and on nothing else.

    The samples of a texel fill the square evenly, at each facet in another order: the R2 sequence (Roberts 2018, The
    unreasonable effectiveness of quasirandom sequences), shifted at random.
    """

    def __init__(self, mi, key, texel, sample, samples):
        self.mi, self.key, self.texel, self.sample, self.samples = mi, key, texel, sample, samples

    def point(self, depth):
        """Return the points for facet number `depth`, UInt32, of the paths."""
        import drjit as dr

        mi = self.mi
        first, second = mi.sample_tea_32(self.texel, self.key + depth)
        order = mi.permute_kensler(self.sample, self.samples, first ^ (second << 1))
        shift = mi.Point2f(mi.Float(first >> 8), mi.Float(second >> 8)) * 2**-24
        point = shift + mi.Float(order) * mi.Point2f(*R2)
        return point - dr.floor(point)
