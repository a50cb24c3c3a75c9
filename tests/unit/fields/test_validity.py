import math

import pytest
import torch

from neumat.brdf.analytic import GGX
from neumat.brdf.validity import albedo_nodes
from neumat.fields.layout import SIZE, unpack
from neumat.fields.validity import AZIMUTHS, POLAR, directional_albedos, peaks, physical, valid


def lambertian(albedo):
    weights = torch.zeros(SIZE)
    unpack(weights)[-1][1][:] = torch.log1p(torch.as_tensor(albedo) / math.pi)
    return weights


def test_albedo_and_peak_of_a_lambertian_field():
    albedo = torch.tensor([0.9, 0.5, 0.1])
    found = directional_albedos(lambertian(albedo)[None], [0.1, 0.8, 1.4])
    torch.testing.assert_close(found, albedo.expand(1, 3, 3), atol=5e-3, rtol=0)
    torch.testing.assert_close(peaks(lambertian(albedo)[None]), torch.tensor([0.9 / math.pi]))


@pytest.mark.parametrize("alpha", [0.01, 0.1])
@pytest.mark.parametrize("theta_i", [0.1, 1.2, 1.48])
def test_the_quadrature_resolves_highlights(alpha, theta_i):
    def albedo(polar, azimuths):
        *angles, weight = albedo_nodes(theta_i, polar, azimuths)
        return weight @ GGX(alpha, 1.0).eval(*angles).double()

    torch.testing.assert_close(albedo(POLAR, AZIMUTHS), albedo(1024, 256), rtol=0.03, atol=0)


def test_what_is_no_brdf_is_invalid():
    good = lambertian(0.5)
    broken, infinite, sharp = good.clone(), good.clone(), good.clone()
    broken[100], infinite[-1] = math.nan, math.inf
    # One unit of each layer passes 12 - 3000 hx on: f is e^12 in the mirror direction, but within 0.1 degrees only.
    (w1, b1), (w2, _), (w3, b3) = unpack(sharp)
    w1[0, 0], b1[0], w2[0, 0], w3[0, 0], b3[0] = -3000.0, 12.0, 1.0, 1.0, 0.0
    weights = torch.stack([good, broken, infinite, sharp, lambertian(1.1), lambertian(0.0), lambertian(-0.5)])
    assert valid(weights).tolist() == [True] + [False] * 6
    assert directional_albedos(sharp[None], [0.1]).max() < 1 < 1e4 < peaks(sharp[None]).item()


def test_black_in_two_channels_is_a_colour():
    assert valid(lambertian([0.3, 0.0, 0.0])[None]).all()


def test_what_other_programs_show_wrong_is_invalid(leaning):
    weights = torch.stack([leaning(0.05), leaning(1.0), lambertian(1.1)])
    assert physical(weights).tolist() == [True, True, False]
    assert valid(weights).tolist() == [True, False, False]
