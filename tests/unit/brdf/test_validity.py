import torch

from neumat.brdf.analytic import GGX
from neumat.brdf.validity import directional_albedo


def test_energy_creation_shows():
    class Bright:
        def eval(self, theta_h, theta_d, phi_d):
            return torch.ones(len(theta_h), 3)  # albedo pi

    assert (directional_albedo(Bright(), 0.4) > 3).all()


def test_converges_for_a_sharp_highlight():
    coarse, fine = (directional_albedo(GGX(0.05, 1.0), 0.5, resolution=n) for n in (256, 768))
    torch.testing.assert_close(coarse, fine, rtol=2e-3, atol=0)
