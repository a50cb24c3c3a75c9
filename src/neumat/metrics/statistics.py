"""Statistics of a BRDF that say what it is made of, not what colour it has: the same for all orders of its channels."""

import math

import numpy as np

from neumat.fields.validity import directional_albedos
from neumat.metrics.appearance import PEAK_THETA_D, contrast, diffuse_albedo, highlight, profiles, reflectance

THETA_H = (0, 0.5, 1, 2, 3, 5, 7, 10, 14, 19, 25, 32, 40, 50, 60, 70)  # degrees: dense where highlights are
THETA_D = (5, 25, 45, 60, 70, 78)
LIGHT_ANGLES = tuple(math.radians(angle) for angle in (5, 30, 45, 70, 80, 85))
FLOOR = 0.002  # of albedos: below it differences are noise


def statistics(weights):
    """Return the statistics (n, 116), float64, of fields (n, 675).

    Of the diffuse albedo and of the specular one at 30 degrees: the mean logarithm and the differences between the
    sorted channels. Of the mean of the channels: the highlight's contrasts and the logarithms of its widths, its light
    and its peaks (see `neumat.metrics.appearance`), of the directional albedo's growth to the horizon, and of the
    reflectance relative to the diffuse lobe over theta_h at six theta_d.
    """
    diffuse = diffuse_albedo(weights)
    albedo = directional_albedos(weights, LIGHT_ANGLES).numpy()
    specular = np.maximum(albedo[:, 1] - diffuse, 0)
    body, grey = diffuse.mean(1), albedo.mean(2)
    *widths, sharp, broad = highlight(profiles(weights).mean(2), body / math.pi)
    peaks = reflectance(weights, np.zeros(len(PEAK_THETA_D)), PEAK_THETA_D).mean(2)
    theta_h, theta_d = np.meshgrid(THETA_H, THETA_D)
    shape = reflectance(weights, theta_h, theta_d).mean(2)
    parts = [
        *(_sorted_logarithms(x) for x in (diffuse, specular)),
        np.stack([contrast(sharp, body), contrast(broad, body)], 1),
        np.log(np.stack([*widths, sharp, broad], 1) + FLOOR),
        np.log(peaks + FLOOR / math.pi),
        np.log(grey[:, 1:] + FLOOR) - np.log(grey[:, :1] + FLOOR),
        np.log(shape + FLOOR / math.pi) - np.log((body[:, None] + FLOOR) / math.pi),
    ]
    return np.concatenate(parts, 1).astype(float)


def _sorted_logarithms(albedo):
    """Return (n, 3) of albedos (n, 3): the mean of their logarithms, and those of the brighter two channels above the
    darkest."""
    x = np.sort(np.log(albedo + FLOOR), 1)
    return np.concatenate([x.mean(1, keepdims=True), x[:, 1:] - x[:, :1]], 1)
