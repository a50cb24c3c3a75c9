"""The analytic models of `neumat.brdf.analytic` in Dr.Jit, for the BSDF plugins of `mitsuba_bsdf`."""

import math

import drjit as dr
import mitsuba as mi

from neumat.brdf.analytic import SGD_PARAMETERS
from neumat.render.drjit_brdf import half_difference

LEAST = 1e-6  # cosine


def _read(parameters, index):
    """Return the number at `index` of a buffer."""
    return dr.gather(mi.Float, parameters, mi.UInt32(index)) if dr.is_jit_v(mi.Float) else float(parameters[index])


def _read3(parameters, index):
    """Return the numbers from `index` on, a Color3f."""
    return mi.Color3f(*(_read(parameters, index + k) for k in range(3)))


def lambert_value(parameters, wi, wo):
    """Return f, a Color3f, 1/sr, of a Lambert: albedo, three numbers."""
    return _read3(parameters, 0) / math.pi


def glossy_value(parameters, wi, wo):
    """Return f, a Color3f, 1/sr, of a Glossy: albedo, f0 (three each), alpha."""
    sin_h, cos_h, d = half_difference(wi, wo)
    albedo, f0, alpha = _read3(parameters, 0), _read3(parameters, 3), _read(parameters, 6)
    a2 = alpha * alpha
    cos_i, cos_o = dr.maximum(wi.z, LEAST), dr.maximum(wo.z, LEAST)
    stretched = sin_h * sin_h + a2 * cos_h * cos_h
    distribution = a2 / (math.pi * stretched * stretched)
    shadowing = 0.5 / (cos_o * dr.sqrt(a2 + (1 - a2) * cos_i * cos_i) + cos_i * dr.sqrt(a2 + (1 - a2) * cos_o * cos_o))
    away = dr.maximum(1 - d[2], 0.0)
    fresnel = f0 + (1 - f0) * (away * away) * (away * away) * away
    return albedo / math.pi + fresnel * (distribution * shadowing)


def sgd_value(parameters, wi, wo):
    """Return f, a Color3f, 1/sr, of an SGD: the numbers of SGD_PARAMETERS, three each."""
    q = {key: _read3(parameters, 3 * k) for k, key in enumerate(SGD_PARAMETERS)}
    sin_h, cos_h, d = half_difference(wi, wo)
    cos_i, cos_o = dr.clip(wi.z, LEAST, 1.0), dr.clip(wo.z, LEAST, 1.0)
    cos2_h = dr.maximum(cos_h * cos_h, LEAST)
    a = q["alpha"] + sin_h * sin_h / (cos2_h * q["alpha"])
    distribution = q["kappa"] * dr.exp(-a) / (math.pi * dr.power(a, q["p"]) * (cos2_h * cos2_h))
    away = dr.maximum(1 - d[2], 0.0)
    fresnel = q["f0"] - q["f1"] * d[2] + (1 - q["f0"]) * ((away * away) * (away * away) * away)
    specular = q["rho_s"] * distribution * dr.maximum(fresnel, 0.0) * _shadowing(q, cos_i) * _shadowing(q, cos_o)
    return (q["rho_d"] + specular / (cos_i * cos_o)) / math.pi


def _shadowing(q, cosine):
    beyond = dr.maximum(dr.acos(cosine) - q["theta0"], 0.0)
    raised = dr.select(beyond > 0, dr.power(dr.maximum(beyond, 1e-12), q["k"]), 0.0)
    return dr.clip(1 + q["lambda"] * (1 - dr.exp(q["c"] * raised)), 0.0, 1.0)
