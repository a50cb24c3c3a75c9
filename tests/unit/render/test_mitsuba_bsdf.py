import math
import subprocess
import sys

import numpy as np
import pytest
import torch

from neumat.brdf.analytic import GGX, SGD, SGD_PARAMETERS, Glossy, Lambert, sgd_parameters
from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles, half_difference, rusinkiewicz
from neumat.brdf.merl import write_merl
from neumat.brdf.table import Table
from neumat.errors import NeumatError
from neumat.export import export
from neumat.fields.field import Field, log_reflectance
from neumat.fields.layout import SIZE, size
from neumat.render.lobes import SAMPLERS
from neumat.render.mitsuba_scene import bsdf, mitsuba
from neumat.render.quadrature import hemisphere
from neumat.seeds import torch_generator

compiled = pytest.mark.usefixtures("compiled")
NAMES = [
    "black", "matte", "rough", "satin", "eggshell", "plastic",
    "waxed", "glossy", "lacquer", "polished", "steel", "mirror",
]  # fmt: skip
VIEWS = (0.2, 0.9, 1.35)  # polar angles


def load(plugin):
    mitsuba()
    from neumat.render.mitsuba_bsdf import load_dict

    return load_dict(plugin)


def surface(wi):
    """Return the interaction of a view wi (3,) or (n, 3)."""
    import drjit as dr

    mi = mitsuba()
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(wi.float().T.numpy())
    return si


def evaluate(plugin, wi, wo):
    """Return f cos(theta_o) (n, 3) and the density (n,) at directions (n, 3)."""
    mi = mitsuba()
    value, density = plugin.eval_pdf(mi.BSDFContext(), surface(wi), mi.Vector3f(wo.float().T.numpy()))
    return np.array(value).T, np.array(density)


def reflected(plugin, wi, count=1 << 18):
    """Return the means and their standard errors, each (3,), of the weights of drawn directions: a white furnace."""
    import drjit as dr

    mi = mitsuba()
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(5, count)
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(*wi.tolist())
    weight = np.array(plugin.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())[1])
    return weight.mean(1), weight.std(1) / math.sqrt(count)


def albedo(material, theta):
    """Return the directional albedo (3,) by a fixed quadrature."""
    light, view, weight = hemisphere(torch.tensor([theta], dtype=torch.float64))
    up = weight[0] > 0
    return (material.eval(*rusinkiewicz(light[0], view[0]))[up].double() * weight[0][up, None]).sum(0).numpy()


def pairs(count, seed=0):
    """Unit directions (wi, wo), (n, 3): anywhere above the horizon, half of them about the mirror direction."""
    wi, wo, noise = torch.randn(3, count, 3, generator=torch_generator(seed, "pairs"))
    wi[:, 2].abs_(), wo[:, 2].abs_()
    wi = torch.nn.functional.normalize(wi, dim=1)
    wo[: count // 2] = (wi * torch.tensor([-1.0, -1.0, 1.0]) + 0.02 * noise)[: count // 2]
    return wi, torch.nn.functional.normalize(wo, dim=1)


@compiled
def test_a_field_evaluates_as_in_torch():
    # All weights count; the other materials have many zeros. In the plane of incidence phi_d jumps from pi to 0.
    wi, wo = pairs(20_000)
    angles = rusinkiewicz(wo, wi)
    off = torch.sin(angles[2]) > 1e-3
    for seed in range(3):
        weights = 0.3 * torch.randn(SIZE, generator=torch_generator(seed, "field"))
        found, _ = evaluate(load(bsdf(weights)), wi, wo)
        expected = Field(weights).eval(*angles).numpy() * wo[:, 2:].clamp_min(0).numpy()
        assert (np.abs(found - expected) / (1 + expected))[off].max() < 2e-5


@compiled
def test_a_field_is_reciprocal_to_the_last_bit(ladder):
    wi, wo = pairs(20_000)
    for weights in (ladder["mirror"], 0.3 * torch.randn(SIZE, generator=torch_generator(0, "field"))):
        plugin = load(bsdf(weights))
        there, back = plugin.value(*directions(wi, wo)), plugin.value(*directions(wo, wi))
        assert (np.array(there) == np.array(back)).all()


def directions(*both):
    return [mitsuba().Vector3f(w.T.numpy()) for w in both]


@compiled
def test_nothing_below_the_horizon(ladder):
    up, down = torch.tensor([[0.0, 0.6, 0.8]]), torch.tensor([[0.0, 0.6, -0.8]])
    plugin = load(bsdf(ladder["matte"]))
    for wi, wo in ((up, down), (down, up), (down, down)):
        value, density = evaluate(plugin, wi, wo)
        assert (value == 0).all() and (density == 0).all()


def chi_square(plugin, view):
    """Return Mitsuba's chi-square test of a plugin, a dictionary of texts, for a view (3,).

    On a grid of half vectors that is finest where mirrors have their highlight.
    """
    import drjit as dr

    mi = mitsuba()
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest

    wi = mi.Vector3f(*view.tolist())

    class HalfVectors:
        def bounds(self):
            return mi.ScalarBoundingBox2f([0, 0], [1, 1])

        def aspect(self):
            return 1

        def map_forward(self, p):
            sin_h, cos_h = dr.sincos(p.x**4 * (math.pi / 2))
            sin_p, cos_p = dr.sincos(p.y * (2 * math.pi) - math.pi)
            return mi.reflect(wi, mi.Vector3f(sin_h * cos_p, sin_h * sin_p, cos_h))

        def map_backward(self, wo):
            h = dr.normalize(wi + wo)
            theta_h = dr.atan2(dr.hypot(h.x, h.y), h.z)
            u = dr.sqrt(dr.sqrt(theta_h * (2 / math.pi)))
            return mi.Point2f(u, (dr.atan2(h.y, h.x) + math.pi) / (2 * math.pi))

    extra = "".join(f'<string name="{key}" value="{text}"/>' for key, text in plugin.items() if key != "type")
    sample, density = BSDFAdapter(plugin["type"], extra, wi=view.tolist())

    def per_cell(wo):
        """Density over the unit square: dw_o = 4 (w_i . h) sin theta_h dtheta_h dphi_h."""
        h = dr.normalize(wi + wo)
        sin_h = dr.hypot(h.x, h.y)
        u3 = (dr.atan2(sin_h, h.z) * (2 / math.pi)) ** 0.75
        # The grid also has half vectors that are turned away from the view, and give its direction twice.
        return dr.select(wo.z > 0, density(wo) * 4 * dr.dot(wi, h) * sin_h * (2 * math.pi * u3) * (2 * math.pi), 0)

    return ChiSquareTest(HalfVectors(), sample, per_cell, 3, sample_count=200_000, res=41, ires=16)


@compiled
@pytest.mark.parametrize("name", NAMES)
def test_directions_follow_their_density(name, ladder, view, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # the test writes its histogram where it fails
    for theta in VIEWS:
        test = chi_square(bsdf(ladder[name]), view(theta))
        assert test.run(), (theta, test.messages)


@compiled
@pytest.mark.parametrize("name", NAMES)
def test_white_furnace(name, ladder, view):
    plugin = load(bsdf(ladder[name]))
    for theta in VIEWS:
        mean, error = reflected(plugin, view(theta))
        assert np.allclose(mean, albedo(Field(ladder[name]), theta), rtol=0.01, atol=4 * error.max())


@compiled
@pytest.mark.parametrize("sampler", SAMPLERS)
def test_the_sampler_changes_noise_only(sampler, ladder, view):
    mean, error = reflected(load(bsdf(ladder["plastic"]) | {"sampler": sampler}), view(0.9), 1 << 20)
    expected, _ = reflected(load(bsdf(ladder["plastic"])), view(0.9), 1 << 20)
    assert (np.abs(mean - expected) < 5 * error + 1e-4).all()


@compiled
def test_fitted_lobes_leave_less_noise_than_a_cosine(ladder, view):
    for name in NAMES:
        fitted, cosine = (
            np.linalg.norm(reflected(load(bsdf(ladder[name]) | {"sampler": sampler}), view(0.9))[1])
            for sampler in ("fitted", "cosine")
        )

        # At the same count an error 3 times smaller is 10 dB.
        assert fitted < (cosine / 3 if NAMES.index(name) >= NAMES.index("glossy") else 1.05 * cosine + 1e-5)


@compiled
def test_new_weights_need_no_new_kernel(ladder):
    import drjit as dr

    mi = mitsuba()
    wi, wo = pairs(64)
    plugin = load(bsdf(ladder["matte"]))
    parameters = mi.traverse(plugin)
    assert list(parameters.keys()) == ["weights"]
    evaluate(plugin, wi, wo)
    parameters["weights"] = mi.Float(ladder["mirror"].numpy())
    parameters.update()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        found = evaluate(plugin, wi, wo)
        kernels = [kernel for kernel in dr.kernel_history() if kernel["type"] == dr.KernelType.JIT]
    assert kernels and all(kernel["cache_hit"] for kernel in kernels)
    expected = evaluate(load(bsdf(ladder["mirror"])), wi, wo)
    assert all((a == b).all() for a, b in zip(found, expected, strict=True))


def test_an_update_with_nan_ends_in_one_line(ladder):
    parameters = mitsuba().traverse(load(bsdf(ladder["matte"])))
    for bad in (math.nan, math.inf, 3e38):
        parameters["weights"] = type(parameters["weights"])(np.full(SIZE, bad, np.float32))
        with pytest.raises(NeumatError, match="675 finite numbers") as caught:
            parameters.update()
        assert "\n" not in str(caught.value)


@compiled
def test_values_stay_finite(field):
    weights = field()
    weights[-3:] = 89.0  # e^89 is infinite in float32
    wi, wo = pairs(64)
    value, _ = evaluate(load(bsdf(weights)), wi, wo)
    assert np.isfinite(value).all() and value.max() > 1e34


@compiled
def test_gradient_of_the_value_is_that_of_torch_and_of_finite_differences():
    import drjit as dr

    mi = mitsuba()
    wi, wo = pairs(2000)
    start = 0.3 * torch.randn(SIZE, generator=torch_generator(0, "field"))
    plugin = load(bsdf(start))
    parameters = mi.traverse(plugin)
    dr.enable_grad(parameters["weights"])
    parameters.update()
    value = plugin.eval(mi.BSDFContext(), surface(wi), mi.Vector3f(wo.T.numpy()))
    dr.backward(dr.sum(value, axis=None))
    found = parameters["weights"].grad.numpy()
    inputs = half_difference(*rusinkiewicz(wo.double(), wi.double()))
    cosine = wo[:, 2:].double() * (wo[:, 2:] > 0)

    def total(weights):
        return (torch.expm1(log_reflectance(weights, inputs)).clamp_min(0) * cosine).sum()

    weights = start.double().requires_grad_()
    total(weights).backward()
    expected = weights.grad.numpy()
    assert np.allclose(found, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())
    for i in (0, 200, 400, SIZE - 1):
        step = 1e-5 * torch.eye(SIZE, dtype=torch.float64)[i]
        difference = (total(weights + step) - total(weights - step)).item() / 2e-5
        assert found[i] == pytest.approx(difference, rel=0.01, abs=1e-4 * np.abs(expected).max())


@compiled
def test_gradient_of_a_picture_with_respect_to_the_weights():
    import drjit as dr

    from neumat.render.mitsuba_scene import sphere_scene

    mi = mitsuba()
    field, _ = narrow(4)  # whose kernel compiles in a fraction of the time
    # Lobes that are fitted change with the weights, and with them the noise.
    scene = sphere_scene(bsdf(field) | {"sampler": "cosine"}, 8)
    parameters = mi.traverse(scene)
    (key,) = (key for key in parameters.keys() if key.endswith("weights"))
    start = field.numpy()

    def brightness(weights):
        parameters[key] = weights
        parameters.update()
        return dr.mean(mi.render(scene, parameters, spp=256, seed=3), axis=None)

    weights = mi.Float(start)
    dr.enable_grad(weights)
    dr.backward(brightness(weights))
    gradient = weights.grad.numpy()
    for i in (len(start) - 1, len(start) - 3):  # the last layer's biases, which every direction depends on
        step = np.zeros(len(start), np.float32)
        step[i] = 1e-2
        high, low = (brightness(mi.Float(start + sign * step)).numpy().item() for sign in (1, -1))
        assert gradient[i] == pytest.approx((high - low) / 2e-2, rel=0.03)


@compiled
def test_mitsubas_blend_of_two_of_ours(ladder, view):
    pair = {"a": bsdf(ladder["matte"]), "b": bsdf(ladder["glossy"])}
    blend = load({"type": "blendbsdf", "weight": 0.3, **pair})
    wi, wo = pairs(1000)
    (a, density_a), (b, density_b), (found, density) = (
        evaluate(plugin, wi, wo) for plugin in (load(pair["a"]), load(pair["b"]), blend)
    )
    assert np.allclose(found, 0.7 * a + 0.3 * b, rtol=1e-5)
    assert np.allclose(density, 0.7 * density_a + 0.3 * density_b, rtol=1e-5)
    mean, error = reflected(blend, view(0.9))
    expected = 0.7 * albedo(Field(ladder["matte"]), 0.9) + 0.3 * albedo(Field(ladder["glossy"]), 0.9)
    assert np.allclose(mean, expected, rtol=0.01, atol=4 * error.max())


@pytest.fixture(scope="module")
def table():
    """A glossy table (1458000, 3), with holes in the diffuse part."""
    values = np.full((ENTRIES, 3), np.nan, np.float32)
    valid = above_horizon().nonzero()[:, 0]
    angles = grid_angles(valid)
    values[valid] = (GGX(0.1, 0.5).eval(*angles) + Lambert((0.3, 0.2, 0.1)).eval(*angles)).numpy()
    values[np.random.default_rng(0).choice(valid[len(valid) // 2 :], 1000, replace=False)] = np.nan
    return values


@compiled
@pytest.mark.parametrize("plugin", ["merl", "nbrdf"])
def test_a_table_evaluates_as_in_torch(plugin, table, tmp_path, view):
    write_merl(tmp_path / "a.binary", table)
    loaded = load({"type": plugin, "filename": str(tmp_path / "a.binary")})
    wi, wo = pairs(20_000)
    found, _ = evaluate(loaded, wi, wo)
    expected = Table(table).eval(*rusinkiewicz(wo, wi)).numpy() * wo[:, 2:].clamp_min(0).numpy()
    # The grid is so fine at theta_h = 0 that single precision shows; 1e-4 of the value is a hundredth of a step.
    assert (np.abs(found - expected) / (1 + expected)).max() < 2e-3
    mean, error = reflected(loaded, view(0.9))
    assert np.allclose(mean, albedo(Table(table), 0.9), rtol=0.01, atol=4 * error.max())


def parametrised(name, numbers):
    """Return the Mitsuba dictionary of an analytic plugin."""
    return {"type": name, "parameters": " ".join(repr(float(number)) for number in numbers)}


def analytic(name):
    """Return an analytic plugin, as a dictionary, and its material."""
    if name == "lambert":
        return parametrised(name, (0.3, 0.2, 0.1)), Lambert((0.3, 0.2, 0.1))
    if name == "glossy":
        numbers = (0.3, 0.2, 0.1, 0.04, 0.06, 0.5, 0.08)
        return parametrised(name, numbers), Glossy(numbers[:3], numbers[3:6], numbers[6])
    published = sgd_parameters()[name]
    return parametrised("sgd", torch.cat([published[key] for key in SGD_PARAMETERS])), SGD(published)


@compiled
@pytest.mark.parametrize("name", ["lambert", "glossy", "red-plastic", "chrome", "white-fabric"])
def test_analytic_models_evaluate_as_in_torch(name):
    plugin, material = analytic(name)
    wi, wo = pairs(20_000)
    up = torch.minimum(wi[:, 2], wo[:, 2]) > 0.01  # nearer to the horizon, theta_d of single precision shows
    wi, wo = wi[up], wo[up]
    found, _ = evaluate(load(plugin), wi, wo)
    expected = material.eval(*rusinkiewicz(wo.double(), wi.double())).numpy() * wo[:, 2:].numpy()
    assert np.allclose(found, expected, rtol=1e-3, atol=1e-6)
    assert expected.max() > 0.08


@compiled
@pytest.mark.parametrize("name", ["glossy", "red-plastic"])
def test_analytic_models_are_reciprocal_and_reflect_upwards_only(name):
    plugin = load(analytic(name)[0])
    wi, wo = pairs(5000)
    there, back = plugin.value(*directions(wi, wo)), plugin.value(*directions(wo, wi))
    assert np.allclose(there, back, rtol=1e-5)
    up, down = torch.tensor([[0.0, 0.6, 0.8]]), torch.tensor([[0.0, 0.6, -0.8]])
    for one, other in ((up, down), (down, up), (down, down)):
        value, density = evaluate(plugin, one, other)
        assert (value == 0).all() and (density == 0).all()


@compiled
@pytest.mark.parametrize("name", ["glossy", "red-plastic"])
def test_directions_of_analytic_models_follow_their_density(name, view, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # the test writes its histogram where it fails
    plugin, material = analytic(name)
    test = chi_square(plugin, view(0.9))
    assert test.run(), test.messages
    mean, error = reflected(load(plugin), view(0.9))
    assert np.allclose(mean, albedo(material, 0.9), rtol=0.01, atol=4 * error.max())


def narrow(width):
    """Weights (n,) and widths of a field of another width, whose values are mostly positive."""
    widths = (6, width, width, 3)
    weights = 0.3 * torch.randn(size(widths), generator=torch_generator(width, "field"))
    weights[-3:] += 0.5
    return weights, widths


@compiled
@pytest.mark.parametrize("width", [1, 4, 12, 32])
def test_fields_of_other_widths_evaluate_as_in_torch(width):
    weights, widths = narrow(width)
    wi, wo = pairs(5000)
    angles = rusinkiewicz(wo, wi)
    off = torch.sin(angles[2]) > 1e-3
    found, _ = evaluate(load(bsdf(weights)), wi, wo)
    expected = Field(weights, widths).eval(*angles).numpy() * wo[:, 2:].clamp_min(0).numpy()
    assert (np.abs(found - expected) / (1 + expected))[off].max() < 2e-5
    assert (expected > 0).mean() > 0.2


def test_fields_of_other_widths_refuse_nan():
    parameters = mitsuba().traverse(load(bsdf(narrow(4)[0])))
    parameters["weights"] = type(parameters["weights"])(np.full(size((6, 4, 4, 3)), np.nan, np.float32))
    with pytest.raises(NeumatError, match="63 finite numbers"):
        parameters.update()


@compiled
def test_conserve_scales_what_reflects_too_much(field, view):
    bright = field(2.0)
    assert reflected(load(bsdf(bright)), view(0.5))[0].max() > 1.9
    assert reflected(load(bsdf(bright) | {"conserve": True}), view(0.5))[0].max() == pytest.approx(1, abs=0.02)
    dark = field(0.5)
    assert reflected(load(bsdf(dark) | {"conserve": True}), view(0.5))[0].max() == pytest.approx(0.5, abs=0.01)


@compiled
def test_exported_files_load(ladder, tmp_path):
    wi, wo = pairs(500)
    expected, _ = evaluate(load(bsdf(ladder["satin"])), wi, wo)
    for format in ("npy", "keras", "safetensors"):
        path = export(ladder["satin"], format, tmp_path, "satin")
        assert (evaluate(load({"type": "nbrdf", "filename": str(path)}), wi, wo)[0] == expected).all()


@pytest.mark.parametrize(
    ("plugin", "words"),
    [
        ({"type": "nbrdf"}, "filename or weights"),
        ({"type": "glossy"}, "the property parameters"),
        ({"type": "glossy", "parameters": "0.1 0.1 0.1 0.1 0.1 0.1 0"}, "alpha > 0"),
        ({"type": "sgd", "parameters": " ".join(["0"] * 33)}, "alpha > 0"),
        ({"type": "nbrdf", "weights": "1 2 three"}, "675 numbers"),
        ({"type": "nbrdf", "weights": "1 2 3"}, "675 numbers"),
        ({"type": "nbrdf", "weights": " ".join(["nan"] * SIZE)}, "675 finite numbers"),
        ({"type": "nbrdf", "weights": " ".join(["0"] * 64)}, "as many as a field of another width has; found 64"),
        ({"type": "nbrdf", "weights": " ".join(["nan"] * 63)}, "63 finite numbers"),
        ({"type": "glossy", "parameters": "0.5 0.5 0.5 0.04 0.04 0.04"}, "7 finite numbers; found 6"),
        ({"type": "glossy", "parameters": "0.5 0.5 0.5 0.04 0.04 0.04 nan"}, "7 finite numbers"),
        ({"type": "glossy", "parameters": "0.5 0.5 0.5 0.04 0.04 0.04 rough"}, "7 numbers; found .*rough"),
        ({"type": "sgd", "parameters": " ".join(["1"] * 32)}, "33 finite numbers; found 32"),
        ({"type": "sgd", "parameters": " ".join(["1"] * 32 + ["inf"])}, "33 finite numbers"),
        ({"type": "nbrdf", "filename": "no/such.safetensors"}, "no such file"),
        ({"type": "nbrdf", "filename": "no/such.h5", "material": "chrome"}, "no such file"),
        ({"type": "merl"}, "the property filename"),
        ({"type": "merl", "filename": "no/such.binary"}, "no such file"),
        ({"type": "nbrdf", "weights": " ".join(["0"] * SIZE), "sampler": "none"}, "fitted"),
        ({"type": "lambert", "parameters": "0.5 0.5 0.5", "lobes": "0.1"}, "64 shares.*found 1 numbers"),
        ({"type": "lambert", "parameters": "0.5 0.5 0.5", "lobes": "0 " * 64, "sampler": "ggx"}, "no property sampler"),
    ],
)
def test_bad_input_ends_in_one_line(plugin, words):
    with pytest.raises(NeumatError, match=words) as caught:
        load({"type": "blendbsdf", "weight": 0.5, "a": plugin, "b": {"type": "diffuse"}})
    assert "\n" not in str(caught.value)


def test_without_llvm_the_scalar_variant_has_the_same_plugins(table, tmp_path):
    write_merl(tmp_path / "a.binary", table)
    code = f"""
import mitsuba as mi, numpy as np, torch
mi.set_variant("scalar_rgb")
from neumat.render.mitsuba_bsdf import load_dict
from neumat.brdf.coordinates import rusinkiewicz
from neumat.brdf.merl import read_merl
from neumat.brdf.table import Table
from neumat.fields.field import Field
weights = 0.2 * torch.randn(675, generator=torch.Generator().manual_seed(1))
wi, wo = torch.nn.functional.normalize(torch.tensor([[[0.3, 0.2, 0.7]], [[-0.4, 0.1, 0.6]]]), dim=2)
field = {{"type": "nbrdf", "weights": " ".join(map(str, weights.tolist()))}}
merl = {{"type": "merl", "filename": r"{tmp_path / "a.binary"}"}}
si = mi.SurfaceInteraction3f()
si.wi = mi.Vector3f(wi[0].tolist())
for plugin, material in ((field, Field(weights)), (merl, Table(read_merl(merl["filename"])))):
    plugin = load_dict(plugin)
    value, density = plugin.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(wo[0].tolist()))
    expected = material.eval(*rusinkiewicz(wo, wi))[0] * wo[0, 2]
    assert np.allclose(list(value), expected, rtol=1e-3), (value, expected)
    sample, weight = plugin.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.9, 0.4))
    assert sample.pdf > 0 and np.isfinite(list(weight)).all()
    for below in ([0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [float("nan")] * 3):  # where numbers raise and arrays have NaN
        nothing = mi.SurfaceInteraction3f()
        nothing.wi = mi.Vector3f(below)
        value, density = plugin.eval_pdf(mi.BSDFContext(), nothing, mi.Vector3f(wo[0].tolist()))
        assert max(value) == density == max(plugin.sample(mi.BSDFContext(), nothing, 0.5, mi.Point2f(0.9, 0.4))[1]) == 0
plugin = load_dict(field)
parameters = mi.traverse(plugin)
parameters["weights"] = mi.ArrayXf([0.0] * 675)
parameters.update()
assert max(plugin.eval(mi.BSDFContext(), si, mi.Vector3f(wo[0].tolist()))) == 0
scene = load_dict({{"type": "scene", "i": {{"type": "path"}}, "e": {{"type": "constant"}},
    "s": {{"type": "sphere", "b": {{"type": "blendbsdf", "weight": 0.5, "a": field, "b": merl}}}},
    "c": {{"type": "perspective", "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
    "f": {{"type": "hdrfilm", "width": 4, "height": 4}}}}}})
assert np.isfinite(np.array(mi.render(scene, spp=4))).all()
"""
    subprocess.run([sys.executable, "-c", code], check=True)
