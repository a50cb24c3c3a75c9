import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from neumat.brdf.analytic import GGX, SGD, Lambert, ggx_distribution, sgd_parameters
from neumat.brdf.coordinates import above_horizon, cosines, grid_angles
from neumat.brdf.validity import directional_albedo
from neumat.errors import NeumatError

angle = st.floats(0, math.pi / 2)


@pytest.mark.parametrize("theta_i", [0.0, 0.7, 1.4])
def test_lambert_reflects_its_albedo(theta_i):
    albedo = torch.tensor([0.2, 0.5, 1.0], dtype=torch.float64)
    torch.testing.assert_close(directional_albedo(Lambert(albedo), theta_i), albedo, atol=2e-3, rtol=0)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.5, 1.0])
def test_ggx_normals_cover_the_surface_once(alpha):
    # Integral of D cos over the hemisphere is 1; substituting tan theta = alpha t keeps the peak resolved.
    t = torch.logspace(-4, 5, 20001, dtype=torch.float64)
    theta = torch.atan(alpha * t)
    cosine = torch.cos(theta)
    total = torch.trapezoid(ggx_distribution(cosine, alpha) * cosine * torch.sin(theta) * 2 * math.pi, theta)
    assert abs(total.item() - 1) < 1e-4


@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.6, 1.0])
@pytest.mark.parametrize("theta_i", [0.0, 0.6, 1.2, 1.5])
def test_ggx_creates_no_energy(alpha, theta_i):
    albedo = directional_albedo(GGX(alpha, 1.0), theta_i)
    assert (albedo < 1.002).all()
    assert (albedo > 0.3).all()  # what single scattering loses at the roughest


def test_smooth_ggx_reflects_schlicks_share():
    f0 = torch.tensor([0.04, 0.5, 1.0], dtype=torch.float64)
    theta_i = 0.8
    expected = f0 + (1 - f0) * (1 - math.cos(theta_i)) ** 5
    torch.testing.assert_close(directional_albedo(GGX(0.02, f0), theta_i), expected, atol=5e-3, rtol=1e-2)


@settings(max_examples=50)
@given(angle, angle, st.floats(0, math.pi))
@pytest.mark.parametrize("material", [Lambert(0.5), GGX(0.2, 0.9), SGD.named("chrome")], ids=["lambert", "ggx", "sgd"])
def test_reciprocal_finite_and_dark_below_the_horizon(material, theta_h, theta_d, phi_d):
    angles = torch.tensor([[theta_h], [theta_d], [phi_d]], dtype=torch.float64)
    value = material.eval(*angles)
    swapped = material.eval(angles[0], angles[1], angles[2] + math.pi)
    cos_i, cos_o = cosines(*angles)
    if min(cos_i.abs(), cos_o.abs()) > 1e-9:  # else rounding decides which side of the horizon it is
        torch.testing.assert_close(value, swapped, rtol=1e-4, atol=1e-6)
    assert value.isfinite().all() and (value >= 0).all()
    if min(cos_i, cos_o) < 0:
        assert (value == 0).all()


def test_sgd_is_finite_and_not_negative_for_all_materials():
    names = list(sgd_parameters())
    assert len(names) == 100
    angles = grid_angles(above_horizon().nonzero()[::401, 0])
    for name in names:
        value = SGD.named(name).eval(*angles)
        assert value.shape == (len(angles[0]), 3) and value.dtype == torch.float32
        assert value.isfinite().all() and (value >= 0).all(), name


def test_sgd_looks_like_what_it_was_fitted_to():
    normal = torch.zeros(1)
    chrome, rubber = (SGD.named(name).eval(normal, normal, normal) for name in ("chrome", "black-soft-plastic"))
    assert (chrome > 20 * rubber).all()
    red = SGD.named("red-plastic").eval(torch.tensor([0.8]), torch.tensor([0.3]), normal)[0]
    assert red[0] > 3 * red[2]


def test_unknown_sgd_material():
    with pytest.raises(NeumatError, match="vibranium"):
        SGD.named("vibranium")
