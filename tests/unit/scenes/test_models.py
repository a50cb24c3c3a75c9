import numpy as np
import pytest
import torch

from neumat.brdf.analytic import SGD_PARAMETERS, Glossy, sgd_parameters
from neumat.brdf.coordinates import ENTRIES, above_horizon, grid_angles, rusinkiewicz
from neumat.fields.layout import SIZE, size
from neumat.render.lobes import fit_lobes
from neumat.render.mitsuba_scene import mitsuba, render_bsdf
from neumat.scenes.models import ANALYTIC, WIDTHS, Model
from neumat.seeds import torch_generator

compiled = pytest.mark.usefixtures("compiled")
RUNGS = (*ANALYTIC, *WIDTHS, "table")
BYTES = dict(zip(RUNGS, (12, 28, 132, 252, 620, 852, 1116, 1740, 2700, 17_496_000), strict=True))
ROUGH = Glossy((0.3, 0.2, 0.1), (0.05, 0.06, 0.1), 0.4)


def model(rung):
    """Return a Model of a rung: a plausible material."""
    if rung == "table":
        valid = above_horizon()
        values = torch.full((ENTRIES, 3), torch.nan)
        values[valid] = ROUGH.eval(*grid_angles(valid.nonzero()[:, 0]))
        return Model(rung, values.flatten())
    if rung == "sgd":
        published = sgd_parameters()["red-plastic"]
        return Model(rung, torch.cat([published[key] for key in SGD_PARAMETERS]).float())
    if rung in WIDTHS:
        width = WIDTHS[rung]
        weights = 0.3 * torch.randn(size((6, width, width, 3)), generator=torch_generator(0, rung))
        weights[-3:] = 1.0  # the last biases: most values are positive
        return Model(rung, weights)
    return Model(rung, torch.tensor([0.5, 0.3, 0.1] if rung == "lambert" else [0.3, 0.1, 0.05, 0.04, 0.05, 0.06, 0.2]))


@pytest.fixture(scope="module", params=RUNGS)
def rung(request):
    return model(request.param)


def pairs(count):
    """Unit directions above the horizon, two of (n, 3)."""
    both = torch.randn(2, count, 3, generator=torch_generator(0, "pairs"))
    both[..., 2] = both[..., 2].abs() + 0.05
    return torch.nn.functional.normalize(both, dim=2)


def test_bytes(rung):
    assert rung.bytes == BYTES[rung.rung]


@compiled
def test_the_plugin_evaluates_as_the_material(rung, tmp_path):
    import drjit as dr

    mi = mitsuba()
    from neumat.render.mitsuba_bsdf import load_dict

    wi, wo = pairs(2000)
    si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
    si.wi = mi.Vector3f(wi.T.numpy())
    plugin = load_dict(rung.plugin(tmp_path))
    found = np.array(plugin.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T.numpy()))).T
    expected = rung.material.eval(*rusinkiewicz(wo, wi)).numpy() * wo[:, 2:].numpy()
    # Tables on a grid as fine as MERL's show single precision.
    assert np.allclose(found, expected, rtol=1e-3 if rung.rung == "table" else 1e-4, atol=1e-5)
    assert (expected > 0).mean() > 0.2


def test_tables_are_written_beside_each_other(tmp_path):
    table = model("table")
    plugins = [Model("table", scale * table.numbers).plugin(tmp_path) for scale in (1.0, 0.5)]
    assert plugins[0]["filename"] != plugins[1]["filename"] and len(list(tmp_path.iterdir())) == 2


def constant(albedo):
    """Return Models of one diffuse material: an analytic one, and a field whose last biases say the same."""
    weights = torch.zeros(SIZE)
    weights[-3:] = torch.log1p(torch.tensor(albedo) / torch.pi)
    return Model("lambert", torch.tensor([albedo] * 3)), Model("field-21", weights)


@compiled
def test_equal_values_show_no_difference_where_both_are_drawn_by_the_same_lobes(tmp_path):
    """Drawn by their own, they would show the noise of other paths."""
    lobes = fit_lobes(model("glossy").material)
    assert lobes.max() > 0.1
    analytic, field = constant(0.6)
    same = [render_bsdf(one.plugin(tmp_path, lobes), 24, 16) for one in (analytic, field)]
    assert np.abs(same[0] - same[1]).max() < 1e-4
    own = render_bsdf(field.plugin(tmp_path), 24, 16)
    assert np.abs(own - same[1]).mean() > 1e-3
    assert own.mean() == pytest.approx(same[1].mean(), rel=0.03)


@compiled
def test_a_materials_own_lobes_given_as_text_draw_what_it_draws(rung, tmp_path):
    if rung.rung == "lambert":
        pytest.skip("Mitsuba's own diffuse draws by other numbers")
    own = render_bsdf(rung.plugin(tmp_path), 16, 4)
    given = render_bsdf(rung.plugin(tmp_path, fit_lobes(rung.material)), 16, 4)
    assert np.allclose(own, given, rtol=1e-3, atol=1e-4)


@compiled
def test_a_table_and_what_it_was_tabulated_from_look_alike(tmp_path):
    lobes = fit_lobes(ROUGH)
    glossy = Model("glossy", torch.tensor([*ROUGH.base.albedo, *ROUGH.lobe.f0, ROUGH.lobe.alpha]))
    pictures = [render_bsdf(one.plugin(tmp_path, lobes), 32, 16) for one in (model("table"), glossy)]
    noise = render_bsdf(glossy.plugin(tmp_path, lobes), 32, 16, seed=1) - pictures[1]
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.1 * np.abs(noise).mean()
