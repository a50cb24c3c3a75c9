import math
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
import torch

from neumat.btf.directions import random_pairs
from neumat.btf.endless import endless
from neumat.btf.representations.encoding import Encoding
from neumat.btf.representations.registry import make
from neumat.btf.synthesis import SYNTHESES
from neumat.errors import NeumatError
from neumat.render.mitsuba_scene import mitsuba
from neumat.seeds import torch_generator

compiled = pytest.mark.usefixtures("compiled")
SIZE = (28, 36)


def representation(name="ours", bits=32, brightness=0.3):
    """Return one of random planes and a random network, as large as a fit would leave them."""
    made = make(name, {"bits": bits})
    generator = torch_generator(0, name)

    def normal(*shape):
        return torch.randn(*shape, generator=generator)

    zeros = torch.zeros(5, 3)
    zeros[:, 2] = 1
    positions, extras = made.parametrise(zeros, zeros)
    inputs = made.channels + len(positions) * made.features + len(extras)
    widths = [inputs, *[made.width] * made.hidden, 3]
    layers = [normal(n, m) / math.sqrt(m) for m, n in pairwise(widths)]
    planes = [normal(made.side**2, made.features) for _ in positions]
    made.size = SIZE
    noise = normal(SIZE[0] + 4, SIZE[1] + 4, made.channels)
    smooth = noise.unfold(0, 5, 1).unfold(1, 5, 1).mean((3, 4))
    made.state = made._state(3 * smooth, planes, layers, Encoding(brightness, made.curve, 2.0))
    return made


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    path = tmp_path_factory.mktemp("btf") / "ours.safetensors"
    representation().save(path)
    return path


def load(path, **properties):
    mitsuba()
    import neumat.btf.mitsuba_btf  # noqa: F401 - registers the plugin
    from neumat.render.mitsuba_bsdf import load_dict

    return load_dict({"type": "btf", "filename": str(path), **properties})


def surface(u, wi):
    """Return the interaction of a plane whose axes are those of uv."""
    import drjit as dr

    mi = mitsuba()
    si = dr.zeros(mi.SurfaceInteraction3f, len(u))
    si.wi, si.uv = mi.Vector3f(wi.T.numpy()), mi.Point2f(u.float().T.numpy())
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    return si


def queries(count, extent=3.0):
    generator = torch_generator(1, "queries")
    light, view = random_pairs(count, generator)
    u = (torch.rand(count, 2, generator=generator) * 2 - 1) * extent
    return u.double(), light, view


@compiled
@pytest.mark.parametrize(
    ("name", "half"),
    [("ours", False), ("ours", True), ("mean", False), ("triple-plane", False), ("biplane", False), ("neumip", False)],
)
def test_values_are_those_of_torch(name, half):
    mi = mitsuba()
    from neumat.btf.compiled.decoder import Decoder

    made = representation(name)
    _, light, view = queries(4000)
    light[:50, 2] *= -1
    features = torch.randn(4000, made.positional().shape[2], generator=torch_generator(2, "features"))
    found = Decoder(made, half).value(
        [mi.Float(column.numpy()) for column in features.T], mi.Vector3f(light.T.numpy()), mi.Vector3f(view.T.numpy())
    )
    expected = made.eval(features, light, view)
    assert (np.array(found).T[:50] == 0).all()
    assert (expected - torch.from_numpy(np.array(found)).T).abs().max() < (3e-2 if half else 2e-4) * expected.max()


@compiled
@pytest.mark.parametrize("tileable", [False, True])
@pytest.mark.parametrize("method", list(SYNTHESES))
def test_features_are_those_of_torch(method, tileable):
    mi = mitsuba()
    from neumat.btf.compiled.registry import endless_plane

    synthesis = SYNTHESES[method](representation().positional(), 7, tileable)
    u = queries(3000)[0]
    u[1000:2000] += 1e5
    u[2000:] -= 3e8  # about what 32 bits count of the cells
    level = torch.rand(3000, generator=torch_generator(3, "levels")) * (synthesis.top + 1)
    endless = endless_plane(synthesis)
    point = mi.Point2d(u.T.numpy())
    for given, expected in ((None, synthesis.at(u)), (mi.Float(level.numpy()), synthesis.at(u, level))):
        found = torch.stack([torch.from_numpy(np.array(each)) for each in endless.at(point, given)], 1)
        # A tile's choice may turn where a place is a rounding away from the next sample.
        wrong = (found - expected).abs().amax(1) > 2e-3
        assert wrong.float().mean() < 2e-3, method


@compiled
@pytest.mark.parametrize("method", ["histogram", "corner"])
def test_the_plugin_evaluates_an_endless_btf(method, saved):
    mi = mitsuba()
    u, light, view = queries(2000)
    plugin = load(saved, synthesis=method, scale=0.25, seed=5, level=0.0)
    made = representation()
    expected = endless(made, method, 5, False).eval(u.float().double() * 4, light, view)
    si, wo = surface(u, view), mi.Vector3f(light.T.numpy())
    value = torch.from_numpy(np.array(plugin.eval(mi.BSDFContext(), si, wo))).T
    assert ((value - expected).abs().amax(1) < 1e-3 * expected.max()).float().mean() > 0.998
    # Importance comes from the light: there f / cos(light) is the same, and the cosine is that of the other side.
    context = mi.BSDFContext(mi.TransportMode.Importance)
    adjoint = plugin.eval(context, surface(u, light), mi.Vector3f(view.T.numpy()))
    adjoint = torch.from_numpy(np.array(adjoint)).T * light[:, 2:] / view[:, 2:]
    assert torch.allclose(adjoint, value, rtol=1e-4, atol=1e-6)


@compiled
def test_mirrored_uv_turns_directions(saved):
    mi = mitsuba()
    u, light, view = queries(500)
    plugin = load(saved, level=0.0)
    plain = np.array(plugin.eval(mi.BSDFContext(), surface(u, view), mi.Vector3f(light.T.numpy())))
    si = surface(u, view * torch.tensor([1.0, -1.0, 1.0]))
    si.dp_dv = mi.Vector3f(0, -1, 0)
    mirrored = plugin.eval(mi.BSDFContext(), si, mi.Vector3f((light * torch.tensor([1.0, -1.0, 1.0])).T.numpy()))
    assert np.allclose(plain, np.array(mirrored), atol=1e-6)


@compiled
def test_a_rays_footprint_sets_the_level_of_detail(saved):
    mi = mitsuba()
    u, light, view = queries(500)
    wo, si = mi.Vector3f(light.T.numpy()), surface(u, view)
    si.duv_dx, si.duv_dy = mi.Vector2f(8 / 36, 0), mi.Vector2f(0, 2 / 36)  # 8 texels wide
    found = np.array(load(saved).eval(mi.BSDFContext(), si, wo))
    assert np.allclose(found, np.array(load(saved, level=3.0).eval(mi.BSDFContext(), si, wo)), atol=1e-4)
    sharp = np.array(load(saved, level=0.0).eval(mi.BSDFContext(), si, wo))
    assert np.abs(found - sharp).max() > 1e-2
    assert load(saved).needs_differentials() and not load(saved, level=0.0).needs_differentials()


@compiled
def test_directions_follow_their_density(saved):
    import drjit as dr

    mi = mitsuba()
    plugin, count = load(saved, level=0.0), 1 << 17
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(5, count)
    for polar in (0.2, 1.3):
        si = surface(torch.zeros(1, 2), torch.tensor([[math.sin(polar), 0.0, math.cos(polar)]]))
        drawn, weight = plugin.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())
        assert np.allclose(np.array(plugin.pdf(mi.BSDFContext(), si, drawn.wo)), np.array(drawn.pdf), rtol=1e-3)
        # What even directions say of the reflected light.
        wo = mi.warp.square_to_uniform_hemisphere(sampler.next_2d())
        even = np.array(plugin.eval(mi.BSDFContext(), si, wo)) * 2 * math.pi
        found, expected = np.array(weight).mean(1), even.mean(1)
        error = (np.array(weight).var(1) + even.var(1)) ** 0.5 / count**0.5
        assert (np.abs(found - expected) <= 4.5 * error).all()
        density = np.array(plugin.pdf(mi.BSDFContext(), si, wo)) * 2 * math.pi
        assert abs(density.mean() - 1) < 5 * density.std() / count**0.5 + 0.02  # some lobes reach below the horizon
    assert dr.all(drawn.pdf >= 0)


def test_the_scalar_variant_evaluates_the_same(saved):
    u, light, view = queries(8)
    made = representation()
    expected = endless(made, "histogram", 0, False).eval(u.float().double(), light, view, 1.0)
    program = f"""
import mitsuba as mi
mi.set_variant("scalar_rgb")
import neumat.mitsuba
plugin = mi.load_dict({{"type": "btf", "filename": {str(saved)!r}, "level": 1.0}})
si = mi.SurfaceInteraction3f()
si.sh_frame, si.dp_dv = mi.Frame3f([1, 0, 0], [0, 1, 0], [0, 0, 1]), [0, 1, 0]
for uv, light, view in zip({u.float().tolist()}, {light.tolist()}, {view.tolist()}):
    si.uv, si.wi = uv, view
    print(*plugin.eval(mi.BSDFContext(), si, mi.Vector3f(light)))
"""
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    found = torch.tensor([[float(number) for number in line.split()] for line in found.splitlines()])
    assert torch.allclose(found, expected, rtol=1e-3, atol=1e-4)


@compiled
def test_gradient_with_respect_to_the_plane(saved):
    import drjit as dr

    mi = mitsuba()
    plugin = load(saved, synthesis="tiling", level=0.0)
    parameters = mi.traverse(plugin)
    u, light, view = queries(200)
    si, wo = surface(u, view), mi.Vector3f(light.T.numpy())
    start = parameters["plane"].numpy().copy()  # what Dr.Jit lends is freed when the plane changes

    def total(values):
        parameters["plane"] = values
        return dr.sum(dr.sum(plugin.eval(mi.BSDFContext(), si, wo)))

    values = mi.Float(start)
    dr.enable_grad(values)
    dr.backward(total(values))
    gradient = dr.grad(values).numpy()
    largest = np.abs(gradient).argmax()
    step = np.zeros_like(start)
    step[largest] = 1e-3
    slope = (total(mi.Float(start + step)).numpy() - total(mi.Float(start - step)).numpy()) / 2e-3
    assert slope == pytest.approx(gradient[largest], rel=2e-2)


@pytest.mark.parametrize(
    ("properties", "words"),
    [
        ({"synthesis": "stretching"}, "one of tiling"),
        ({"scale": 0.0}, "above 0"),
        ({"filename": "none.safetensors"}, "none.safetensors"),
        ({"sampler": "best"}, "sampler"),
    ],
)
def test_bad_input_ends_in_one_line(properties, words, saved):
    with pytest.raises(NeumatError, match=words):
        load(**{"path": properties.pop("filename", saved)}, **properties)
