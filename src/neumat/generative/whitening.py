"""Data coordinates: an affine map between weight vectors and the numbers a denoiser works on."""

import torch

from neumat.brdf.coordinates import cosines, half_difference
from neumat.errors import NeumatError
from neumat.fields.field import log_reflectance

METRICS = ("variance", "effect", "standard")
CONSTANT = 1e-8  # a weight of at most this standard deviation does not vary
RIDGE = 1e-3  # of the mean of the metric's diagonal: keeps directions without any effect invertible


def effect_metric(weights, generator, materials=200, directions=256):
    """Return the mean Gauss-Newton metric (675, 675), float64, of what the fields `weights` (n, 675) look like.

    delta^T M delta is the mean squared change, over materials, directions and channels, that a small change delta of
    the weights makes to log(1 + f cos theta_i), which BRDF distances see, plus that to the sRGB tone of f cos theta_i,
    which pictures show, dark materials above all. Directions above the horizon: for the first, uniform on the MERL
    grid's axes (theta_h on its square-root axis, so dense in the highlight); for the second, in uniform angles.
    """
    chosen = weights[torch.randperm(len(weights), generator=generator)[:materials]].float()
    total = torch.zeros(weights.shape[1], weights.shape[1], dtype=torch.float64)
    for seen, exponent in ((torch.log1p, 2), (_tone, 1)):
        u = torch.rand(4 * directions, 3, generator=generator, dtype=torch.float64)
        theta_h, theta_d, phi_d = u[:, 0] ** exponent * torch.pi / 2, u[:, 1] * torch.pi / 2, u[:, 2] * torch.pi
        cos_i, cos_o = cosines(theta_h, theta_d, phi_d)
        above = ((cos_i > 0.05) & (cos_o > 0.05)).nonzero()[:directions, 0]
        inputs = half_difference(theta_h, theta_d, phi_d)[above].float()
        inputs[1::2, 3:5] *= -1  # other programs evaluate fields without folding phi_d to [0, pi)

        def response(vector, direction, cosine, seen=seen):
            return seen(torch.expm1(log_reflectance(vector, direction[None])[0]).clamp_min(0) * cosine)

        jacobians = torch.func.vmap(torch.func.jacrev(response), (None, 0, 0))
        for vector in chosen:
            jacobian = jacobians(vector, inputs, cos_i[above].float()).flatten(0, 1)
            total += (jacobian.T @ jacobian).double()
    return total / (len(chosen) * directions * 3)


def _tone(shaded):
    """Return the sRGB tone in [0, 1] of f cos theta_i under a light that shows white Lambert at 0.9."""
    x = (2.5 * shaded).clamp(0, 1)
    return torch.where(x < 0.0031308, 12.92 * x, 1.055 * x.clamp_min(0.0031308) ** (1 / 2.4) - 0.055)


class Coordinates:
    """encode: (n, 675) -> (n, k), decode: back. Principal axes under a metric, scaled by std^-power; or the weights.

    metric "variance" measures each weight in its own standard deviations; "effect" also by what it does to the
    BRDF (`effect_metric`), so that equal steps are equally visible. power 1 whitens; 0 keeps the metric's lengths.
    metric "standard" measures as "variance" does and does not rotate: k is 675, coordinate i is weight i (0 where
    that is constant), and components and power have no effect. It is the one in which layers and neurons persist.
    Coordinates, constant ones left out, have mean 0 and mean square 1. The fit is in float64.
    """

    def __init__(self, mean, into, back):
        self.mean, self.into, self.back = mean.double(), into.double(), back.double()

    @classmethod
    def fit(cls, weights, components, metric, power, generator):
        """Return the Coordinates of weights (n, 675) with at most `components` axes.

        Raises NeumatError for an unknown metric.
        """
        if metric not in METRICS:
            raise NeumatError("metric", f"one of {', '.join(METRICS)}", metric)
        data = weights.double()
        mean = data.mean(0)
        if metric == "standard":
            std = data.std(0, correction=0)
            return cls(mean, torch.diag(torch.where(std > CONSTANT, 1 / std, 0)), torch.diag(std))
        std = data.std(0).clamp_min(CONSTANT)
        z = (data - mean) / std
        root = inverse = torch.eye(z.shape[1], dtype=torch.float64)
        if metric == "effect":
            scaled = effect_metric(weights, generator) * std * std[:, None]
            values, axes = torch.linalg.eigh(scaled / scaled.diagonal().mean())
            values = values.clamp_min(0) + RIDGE
            root, inverse = (axes * values.sqrt()) @ axes.T, (axes / values.sqrt()) @ axes.T
        _, singular, axes = torch.linalg.svd(z @ root, full_matrices=False)
        spread = singular / len(z) ** 0.5
        k = min(components, int((spread > 1e-6 * spread[0]).sum()))
        spread, axes = spread[:k], axes[:k]
        scale = spread**-power
        scale = scale / ((spread * scale) ** 2).mean().sqrt()
        return cls(mean, (root @ axes.T) * scale / std[:, None], ((axes / scale[:, None]) @ inverse) * std)

    def encode(self, weights):
        """Return the coordinates (n, k), float32, of weights (n, 675)."""
        return ((weights.double() - self.mean) @ self.into).float()

    def encode_change(self, weights):
        """Return what adding `weights` (n, 675) changes in the coordinates, (n, k), float32."""
        return (weights.double() @ self.into).float()

    def decode(self, coordinates):
        """Return the weights (n, 675), float32, of coordinates (n, k)."""
        return (coordinates.double() @ self.back + self.mean).float()

    def state(self):
        """Return the tensors that make these Coordinates, for a checkpoint."""
        return {"mean": self.mean, "into": self.into, "back": self.back}
