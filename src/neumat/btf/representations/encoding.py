"""The space in which networks answer and losses are taken: near to what a display shows."""

import math
from dataclasses import dataclass

import torch

from neumat.errors import NeumatError


@dataclass(frozen=True)
class Encoding:
    """log(1 + k e x) / log(1 + k) of values x, at exposure e: 1 where a picture is white; linear, e x, for k = 0.

    exposure: sr, as `btf.exposure` gives it. curve: k. With k = 24 it follows sRGB's curve to .04 and stays finite for
    highlights of any brightness. ceiling: the largest encoded value that is decoded; brighter ones are cut.
    """

    exposure: float
    curve: float
    ceiling: float = math.inf

    def encode(self, values):
        """Return the encoded values, any shape, of values, 1/sr; negative ones count as 0."""
        scaled = values.clamp_min(0) * self.exposure
        return (self.curve * scaled).log1p_() / math.log1p(self.curve) if self.curve else scaled

    def decode(self, encoded):
        """Return the values, 1/sr, of encoded ones: the inverse of `encode`, cut to 0..ceiling."""
        cut = encoded.clamp(0, self.ceiling)
        if self.curve:
            cut = (cut * math.log1p(self.curve)).expm1_() / self.curve
        return cut / self.exposure

    def tensor(self):
        """Return the three numbers as a tensor (3,), float64."""
        return torch.tensor([self.exposure, self.curve, self.ceiling], dtype=torch.float64)

    def checked(self, values):
        """Return `encode(values)`; raises NeumatError where values are not finite."""
        encoded = self.encode(values)
        if not encoded.sum().isfinite():
            raise NeumatError("store", "finite values", "NaN or infinite ones")
        return encoded
