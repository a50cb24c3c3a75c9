import pytest
import torch

from neumat.brdf.analytic import GGX, Lambert
from neumat.brdf.embedded import Embedded, embedded_names
from neumat.errors import NeumatError
from neumat.render.lobes import ALPHAS, ANGLES, SAMPLERS, fit_lobes, read_lobes, write_lobes


def embedded(name):
    return Embedded(embedded_names().index(name))


@pytest.mark.parametrize("sampler", SAMPLERS)
@pytest.mark.parametrize("albedo", [0.0, 0.5])
def test_a_diffuse_material_has_the_cosine_lobe_alone(sampler, albedo):
    assert fit_lobes(Lambert((albedo,) * 3), sampler).abs().max() == 0


def test_lobes_must_gain_over_all_angles_together():
    """From grazing views lobes would save blue fabric a quarter of its variance, but hardly any in most of a
    picture; red plastic has more to gain from them."""
    assert fit_lobes(embedded("blue-fabric")).abs().max() == 0
    assert fit_lobes(embedded("red-plastic")).sum(1).max() > 0.1


def test_a_lobe_of_the_materials_own_roughness_is_found():
    shares = fit_lobes(GGX(ALPHAS[1], (0.5,) * 3))
    assert shares.shape == (ANGLES, len(ALPHAS))
    assert (shares.argmax(1)[:12] == 1).all()
    assert (shares.sum(1) <= 1 + 1e-6).all()
    assert torch.equal(shares, fit_lobes(GGX(ALPHAS[1], (0.5,) * 3)))


def test_the_text_of_shares_is_read_to_the_last_bit():
    shares = fit_lobes(embedded("red-plastic"))
    assert torch.equal(read_lobes(write_lobes(shares)), shares)


@pytest.mark.parametrize(
    "text",
    ["", "0.1 " * 63, "0.1 " * 65, "0.3 " * 64, "-0.1 " * 64, "nan " * 64, "inf " * 64, "much " * 64],
)
def test_shares_that_are_no_part_of_a_whole_are_refused(text):
    with pytest.raises(NeumatError, match="lobes"):
        read_lobes(text)
