"""What a person would say of a material, measured on the BRDF itself: its colour, its highlight, its gloss.

Nothing here sees a picture or a network's features, so it can judge materials that were made to match them. The words
for the numbers are in `neumat.metrics.words`.
"""

import math

import numpy as np
import pandas as pd
import torch
from skimage.color import xyz2lab
from skimage.color.colorconv import xyz_from_rgb

from neumat.brdf.coordinates import half_difference
from neumat.errors import NeumatError
from neumat.fields.field import evaluate_inputs
from neumat.fields.validity import directional_albedos

DIFFUSE_THETA_H = (45, 50, 55, 60)  # degrees; the diffuse lobe is read here, away from highlight and horizon
DIFFUSE_THETA_D = (5, 15, 25, 35)
PEAK_THETA_D = (5, 30, 60)  # degrees, at which the peak is read
PROFILE_THETA_D = 20  # degrees, at which the highlight is followed over theta_h
PROFILE = np.linspace(0, 1, 181) ** 2 * math.radians(60)  # on a square-root axis, as MERL's
# Highlights by the light within the first theta_h above the level at the second: bright bodies are not flat enough for
# one level. On the 100 sources the first shows the plastics that mirror lamps, the second wood and soft plastic too.
SHARP, BROAD = np.radians([[2.5, 5], [15, 22]])
VISIBLE = 1e-4  # of the diffuse lobe: a highlight below it is rounding
LIGHT_ANGLE = math.radians(30)  # of the directional albedo
# MERL's values are relative: its whitest paint reflects .33, a third of what paint does. A person adapts to that.
WHITE = 0.4
# A metal's highlight is brighter than any dielectric's interface (5 % of white), and its body dark beside it.
METAL_SPECULAR, METAL_RATIO = 0.025, 0.8
LUMINANCE = xyz_from_rgb[1]  # of linear sRGB


def appearance(weights):
    """Return a DataFrame with a row for each of the fields (n, 675).

    Columns: `diffuse_r, _g, _b`, the albedo of the diffuse lobe, pi f; `albedo_r, _g, _b`, the share of light from 30
    degrees that is reflected in all; `specular`, the luminance of what the second is above the first; `specular_ratio`
    to the diffuse luminance; `metallic`, bool; `lightness`, `chroma`, `hue` (degrees), CIELAB under D65, of the
    colour that a person would name, relative to a white of albedo WHITE; `peak_5, _30, _60`, luminance of f at
    theta_h = 0 and theta_d in degrees, 1/sr; `half_width`, the theta_h in radians where f falls half-way from the
    peak to the diffuse lobe, and `spread`, within which half the light of the highlight lies (both pi / 2 without a
    highlight); `contrast` and `sharp_contrast` of the highlight, all of it and its sharp core, with the body.
    Raises NeumatError where a field is not finite.
    """
    diffuse = diffuse_albedo(weights)
    albedo = directional_albedos(weights, [LIGHT_ANGLE])[:, 0].numpy()
    above, luminance = np.maximum(albedo - diffuse, 0), diffuse @ LUMINANCE
    specular = above @ LUMINANCE
    # By the mean of the channels: a blue metal is no less of one for its low luminance.
    metallic = (above.mean(1) > METAL_SPECULAR) & (above.mean(1) > METAL_RATIO * diffuse.mean(1))
    # A dielectric's highlight has the light's colour, not the body's; a metal has no other colour than its highlight's.
    lab = xyz2lab(np.where(metallic[:, None], albedo, diffuse) / WHITE @ xyz_from_rgb.T)
    peak = reflectance(weights, np.zeros(len(PEAK_THETA_D)), PEAK_THETA_D) @ LUMINANCE
    half_width, spread, sharp, broad = highlight(profiles(weights) @ LUMINANCE, luminance / math.pi)
    columns = {f"diffuse_{c}": diffuse[:, k] for k, c in enumerate("rgb")}
    columns |= {f"albedo_{c}": albedo[:, k] for k, c in enumerate("rgb")}
    columns |= {"specular": specular, "specular_ratio": specular / np.maximum(luminance, 1e-6), "metallic": metallic}
    columns |= {"lightness": lab[:, 0], "chroma": np.hypot(lab[:, 1], lab[:, 2])}
    columns |= {"hue": np.degrees(np.arctan2(lab[:, 2], lab[:, 1])) % 360}
    columns |= {f"peak_{angle}": peak[:, k] for k, angle in enumerate(PEAK_THETA_D)}
    columns |= {"half_width": half_width, "spread": spread}
    columns |= {"contrast": contrast(broad, luminance), "sharp_contrast": contrast(sharp, luminance)}
    return pd.DataFrame(columns)


def diffuse_albedo(weights):
    """Return the albedo (n, 3) of the diffuse lobe of fields (n, 675): pi times the median of f away from the
    highlight and the horizon. Raises NeumatError where one is not finite: nothing can be said of such a field."""
    albedo = math.pi * np.median(reflectance(weights, *np.meshgrid(DIFFUSE_THETA_H, DIFFUSE_THETA_D)), 1)
    broken = int((~np.isfinite(albedo)).any(1).sum())
    if broken:
        raise NeumatError(
            "weights", "materials that are valid (neumat.fields.validity)", f"{broken} that are not finite"
        )
    return albedo


def reflectance(weights, theta_h, theta_d):
    """Return f (n, m, 3) of fields at angles in degrees, with light and view on either side of the half vector's
    plane (phi_d = 90 degrees), where neither comes near the horizon."""
    theta_h, theta_d = (torch.deg2rad(torch.as_tensor(np.ravel(x), dtype=torch.float32)) for x in (theta_h, theta_d))
    inputs = half_difference(theta_h, theta_d, torch.full_like(theta_h, math.pi / 2))
    return evaluate_inputs(weights, inputs).numpy()


def profiles(weights):
    """Return f (n, angles, 3), 1/sr, of fields (n, 675) across the highlight, at PROFILE."""
    return reflectance(weights, np.degrees(PROFILE), np.full(len(PROFILE), PROFILE_THETA_D))


def highlight(f, diffuse):
    """Return half_width and spread, radians, and the light of the highlight within SHARP and within BROAD, each (n,).

    f: (n, angles), one channel or a mean of all at PROFILE, 1/sr. diffuse: (n,), that of the diffuse lobe.
    """
    excess = np.maximum(f - diffuse[:, None], 0)
    below = excess <= excess[:, :1] / 2
    half_width = np.where(below.any(1), PROFILE[below.argmax(1)], PROFILE[-1])
    sharp, broad = (_light(f, *cone) for cone in (SHARP, BROAD))
    spread = PROFILE[(broad >= broad[:, -1:] / 2).argmax(1)]
    half_width, spread = (
        np.where(light > VISIBLE * diffuse, x, math.pi / 2)
        for light, x in ((excess[:, 0], half_width), (broad[:, -1], spread))
    )
    return half_width, spread, sharp[:, -1], broad[:, -1]


def _light(f, within, base):
    """Return the reflected light (n, angles), cumulated over PROFILE, of luminances f (n, angles) over half vectors
    `within` an angle, above what f is at the angle `base` (radians)."""
    index = np.searchsorted(PROFILE, base)
    above = np.maximum(f - f[:, index : index + 1], 0) * (within > PROFILE)
    # dw_o = 4 cos(theta_d) dh (Walter et al. 2007, eq. 14), cos(theta_o) = cos(theta_h) cos(theta_d).
    solid_angle = 2 * math.pi * np.sin(PROFILE) * np.gradient(PROFILE)
    cosine = math.cos(math.radians(PROFILE_THETA_D))
    return np.cumsum(above * solid_angle * 4 * cosine**2 * np.cos(PROFILE), 1)


def contrast(specular, diffuse):
    """Return the perceived contrast (n,) of a highlight with the body: cbrt(rho_s + rho_d / 2) - cbrt(rho_d / 2)
    (Pellacini et al. 2000), relative to WHITE."""
    return np.cbrt((specular + diffuse / 2) / WHITE) - np.cbrt(diffuse / 2 / WHITE)
