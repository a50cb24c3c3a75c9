"""Colour models of Bonn's `.btf` files: what the three channels that a file factorises are, by the file's numbers.

Values are linear RGB, (..., 3). Logarithms are of the value + EPSILON, so that zero has one.
"""

import torch

EPSILON = 1e-5
# Rows are R, G, B of (Y, U, V), with the rounded numbers that the format is defined by.
YUV_TO_RGB = torch.tensor([[1, 0, 1.13983], [1, -0.39465, -0.5806], [1, 2.03211, 0]], dtype=torch.float64)
RGB_TO_YUV = torch.linalg.inv(YUV_TO_RGB).float()


def _rgb(y, u, v):
    return torch.stack([row[0] * y + row[1] * u + row[2] * v for row in YUV_TO_RGB.tolist()], -1)


def _log_y_uv(y, u, v):
    return _rgb(y.exp() - EPSILON, u, v)


def _log_y_log_u_log_v(y, u, v):
    u, v = (chroma.sign() * chroma.abs().exp() * EPSILON for chroma in (u, v))
    return _rgb(y.exp() - EPSILON, u, v)


def _log_y_relative_uv(y, u, v):
    y = y.exp()
    return _rgb(y - EPSILON, u * y, v * y)


def _to_log_y_relative_uv(rgb):
    y, u, v = (rgb @ RGB_TO_YUV.T).unbind(-1)
    y = y.clamp_min(0) + EPSILON
    return torch.stack([y.log(), u / y, v / y], -1)


# {number: three channels (...) -> RGB (..., 3)}; the file format knows others, which no public file is known to use.
DECODERS = {
    0: lambda *rgb: torch.stack(rgb, -1),  # RGB
    1: _rgb,  # YUV
    9: _log_y_uv,
    10: _log_y_log_u_log_v,
    11: _log_y_relative_uv,  # UBO2014's
    12: lambda *rgb: torch.stack(rgb, -1).exp() - EPSILON,  # logarithms of RGB
}
# {number: RGB (..., 3) of at least 0 -> channels}: the models that are written.
ENCODERS = {0: lambda rgb: rgb, 11: _to_log_y_relative_uv}
