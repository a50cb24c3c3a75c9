"""Analytic materials, for checks and charts: Lambert, GGX, and SGD with its published fits of MERL."""

import csv
import math
from importlib import resources

import torch

from neumat.brdf.coordinates import cosines
from neumat.errors import NeumatError

SGD_PARAMETERS = ("rho_d", "rho_s", "alpha", "p", "f0", "f1", "kappa", "lambda", "c", "k", "theta0")


class Lambert:
    """An ideally diffuse material: f = albedo / pi. `albedo` is a number or one per channel."""

    def __init__(self, albedo):
        self.albedo = torch.as_tensor(albedo, dtype=torch.float64).expand(3)

    def eval(self, theta_h, theta_d, phi_d):
        """Return BRDF values (n, 3), 1/sr; 0 below the horizon."""
        return _lit(lambda cos_i, cos_o: self.albedo / math.pi, theta_h, theta_d, phi_d)


def ggx_distribution(cos_h, alpha):
    """Return the GGX density of microfacet normals, 1/sr (Walter et al. 2007, eq. 33)."""
    return alpha**2 / (math.pi * (cos_h**2 * (alpha**2 - 1) + 1) ** 2)


class GGX:
    """A rough mirror: GGX normals, height-correlated Smith shadowing (Heitz 2014), Schlick's Fresnel.

    `alpha` is the roughness, `f0` the reflectance at normal incidence (a number or one per channel).
    """

    def __init__(self, alpha, f0):
        self.alpha = alpha
        self.f0 = torch.as_tensor(f0, dtype=torch.float64).expand(3)

    def eval(self, theta_h, theta_d, phi_d):
        """Return BRDF values (n, 3), 1/sr; 0 below the horizon."""

        def value(cos_i, cos_o):
            a2 = self.alpha**2
            # G / (4 cos_i cos_o) in one fraction, which stays finite at the horizon.
            shadowing = 0.5 / (
                cos_o * torch.sqrt(a2 + (1 - a2) * cos_i**2) + cos_i * torch.sqrt(a2 + (1 - a2) * cos_o**2)
            )
            fresnel = self.f0 + (1 - self.f0) * (1 - torch.cos(theta_d.double())[:, None]) ** 5
            return ggx_distribution(torch.cos(theta_h.double())[:, None], self.alpha) * shadowing * fresnel

        return _lit(value, theta_h, theta_d, phi_d)


class Glossy:
    """A diffuse base under one GGX lobe: Lambert(albedo) + GGX(alpha, f0)."""

    def __init__(self, albedo, f0, alpha):
        self.base, self.lobe = Lambert(albedo), GGX(alpha, f0)

    def eval(self, theta_h, theta_d, phi_d):
        """Return BRDF values (n, 3), 1/sr; 0 below the horizon."""
        return self.base.eval(theta_h, theta_d, phi_d) + self.lobe.eval(theta_h, theta_d, phi_d)


def sgd_parameters():
    """Return {material: {parameter: (3,) float64 tensor}} of the 100 MERL materials (Bagher et al. 2012)."""
    text = (resources.files("neumat.brdf") / "data" / "sgd.csv").read_text()
    return {
        row["material"]: {
            key: torch.tensor([float(row[f"{key}_{channel}"]) for channel in "rgb"], dtype=torch.float64)
            for key in SGD_PARAMETERS
        }
        for row in csv.DictReader(text.splitlines())
    }


class SGD:
    """The shifted gamma distribution of microfacets, per channel (Bagher et al. 2012).

    `parameters`: {one of SGD_PARAMETERS: a number per channel}.
    """

    def __init__(self, parameters):
        self.parameters = parameters

    @classmethod
    def named(cls, name):
        """Return the SGD fitted to one of the 100 MERL materials; raises NeumatError for another name."""
        parameters = sgd_parameters()
        if name not in parameters:
            raise NeumatError("SGD material", "the name of one of the 100 MERL materials", repr(name))
        return cls(parameters[name])

    def eval(self, theta_h, theta_d, phi_d):
        """Return BRDF values (n, 3), 1/sr; 0 below the horizon."""
        q = self.parameters

        def value(cos_i, cos_o):
            # Only light or view below the horizon takes theta_h to a right angle, where the bound is met.
            cos2_h = torch.cos(theta_h.double())[:, None].clamp_min(1e-6) ** 2
            cos_d = torch.cos(theta_d.double())[:, None]
            a = q["alpha"] + (1 / cos2_h - 1) / q["alpha"]
            distribution = q["kappa"] * torch.exp(-a) / (math.pi * a ** q["p"] * cos2_h**2)
            fresnel = (q["f0"] - q["f1"] * cos_d + (1 - q["f0"]) * (1 - cos_d) ** 5).clamp_min(0)
            specular = q["rho_s"] * distribution * fresnel * self._shadowing(cos_i) * self._shadowing(cos_o)
            return (q["rho_d"] + specular / (cos_i * cos_o)) / math.pi

        return _lit(value, theta_h, theta_d, phi_d)

    def _shadowing(self, cosine):
        q = self.parameters
        beyond = (torch.acos(cosine) - q["theta0"]).clamp_min(0)
        return (1 + q["lambda"] * (1 - torch.exp(q["c"] * beyond ** q["k"]))).clamp(0, 1)


def _lit(value, theta_h, theta_d, phi_d):
    """Return value(cos_i, cos_o), both (n, 1) float64 and positive, as float32; 0 below the horizon."""
    cos_i, cos_o = (c[:, None] for c in cosines(theta_h.double(), theta_d.double(), phi_d.double()))
    values = value(cos_i.clamp(1e-6, 1), cos_o.clamp(1e-6, 1))
    return torch.where((cos_i > 0) & (cos_o > 0), values, 0.0).float()
