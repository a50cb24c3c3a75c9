"""What the material in a picture would look like in the camera's own light, told from the encoded picture.

Ridge regression on the training materials' augmented pictures: their crop, exposure, white balance and light are what
it learns to see past. The common space of texts and images is made to tell materials apart, and says less of how far
apart they are: among variants of one material its cosine correlates by -.4 with the RMSE under new light, the distance
from the predicted appearance by .8.
"""

import functools

import torch

from neumat.fields.layout import SIZE as FIELD
from neumat.render.scene import to_linear
from neumat.render.sphere import FrozenSphere, render_fields

SIZE, RINGS, AZIMUTHS = 16, 16, 24  # of the pictures that are compared
PENALTY = 1.0
GAIN = 4.0
AXES = 32  # of the appearance of materials: the others hold .01 % of its variance


def rendered_appearance(weights):
    """Return the pictures of fields (n, 675) in the camera's own light, sRGB values in 0..1, (n, 3 SIZE^2)."""
    return render_fields(_camera(), weights).flatten(1).float() / 255


def gains(found, shown):
    """Return the gain (n, 3) of each channel, in linear light, by which pictures `found` (n, p) come nearest to those
    `shown` (n, p), both as `rendered_appearance` returns them; at most GAIN, at least its inverse."""
    found, shown = (to_linear(x.clamp(0, 1)).view(len(x), -1, 3)[:, _sphere()] for x in (found, shown))
    return ((found * shown).sum(1) / found.square().sum(1).clamp_min(1e-9)).clamp(1 / GAIN, GAIN)


@functools.cache
def _sphere():
    """Return which pixels (SIZE^2,) show the sphere alone: those that are black where a material is."""
    return rendered_appearance(torch.zeros(1, FIELD)).view(-1, 3).amax(1) == 0


@functools.cache
def _camera():
    return FrozenSphere(SIZE, RINGS, AZIMUTHS)


class AppearanceRegression:
    """The regression, onto the principal axes of what is seen. state: mean (i,) of encoded pictures, kernel (i, AXES),
    axes (AXES, p), bias (p,).

    Features keep their own scales: were each divided by its deviation, those that spheres hardly ever show and photos
    do would decide, and an orange cloth would be told as green metal.
    """

    def __init__(self, state):
        self.state = state

    @classmethod
    def fit(cls, images, seen):
        """Return the regression fitted to `a` encoded pictures, (n, a, i), of each of n materials, whose appearance
        (see `rendered_appearance`) is `seen` (n, p)."""
        rows = images.flatten(0, 1).double()
        mean, bias = rows.mean(0), seen.double().mean(0)
        rows = rows - mean
        _, _, axes = torch.linalg.svd(seen.double() - bias, full_matrices=False)
        axes = axes[:AXES]
        targets = ((seen.double() - bias) @ axes.T).repeat_interleave(images.shape[1], 0)
        penalty = PENALTY * rows.square().sum(1).mean() * torch.eye(rows.shape[1], dtype=torch.float64)
        kernel = torch.linalg.solve(rows.T @ rows + penalty, rows.T @ targets)
        state = {"mean": mean, "kernel": kernel, "axes": axes.contiguous(), "bias": bias}
        return cls({name: value.float() for name, value in state.items()})

    def __call__(self, features):
        """Return the appearance (n, p) predicted from encoded pictures (n, i)."""
        return (features - self.state["mean"]) @ self.state["kernel"] @ self.state["axes"] + self.state["bias"]
