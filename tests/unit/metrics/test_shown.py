import numpy as np
import pytest
import torch

from neumat.metrics.shown import shown_errors
from neumat.seeds import torch_generator


@pytest.fixture
def pictures():
    """Linear pictures (3, 24, 32, 3), darker than white."""
    return torch.rand(3, 24, 32, 3, generator=torch_generator(0, "pictures")) * 0.5


def test_equal_pictures_have_no_error(pictures):
    found = shown_errors(pictures, pictures.clone(), 1.0)
    assert all(values.shape == (3,) for values in found.values())
    assert (found["psnr"] > 80).all() and np.allclose(found["dssim"], 0) and np.allclose(found["flip"], 0, atol=1e-6)


def test_errors_grow_with_noise_each_for_its_picture(pictures):
    noise = (
        torch.randn(pictures.shape, generator=torch_generator(0, "noise"))
        * torch.tensor([0.01, 0.05, 0.2])[:, None, None, None]
    )
    found = shown_errors(pictures, pictures + noise, 1.0)
    assert (np.diff(found["psnr"]) < 0).all()
    assert (np.diff(found["dssim"]) > 0).all() and (np.diff(found["flip"]) > 0).all()


def test_psnr_of_a_known_difference():
    """Linear .5 and .25 are shown as 188 and 137."""
    expected, found = torch.full((1, 8, 8, 3), 0.5), torch.full((1, 8, 8, 3), 0.25)
    assert shown_errors(expected, found, 1.0)["psnr"][0] == pytest.approx(20 * np.log10(255 / 51), abs=1e-3)
    assert shown_errors(expected / 4, found / 4, 4.0)["psnr"][0] == pytest.approx(20 * np.log10(255 / 51), abs=1e-3)


def test_what_is_beyond_white_is_not_seen(pictures):
    bright = pictures + 1
    assert np.allclose(shown_errors(bright, 3 * bright, 1.0)["flip"], 0, atol=1e-6)
