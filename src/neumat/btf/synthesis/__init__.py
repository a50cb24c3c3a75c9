"""Synthesis by example: endless planes of features from a small one, under one contract (`base.Synthesis`)."""

from neumat.btf.synthesis.autocovariance import Autocovariance
from neumat.btf.synthesis.corner import Corner
from neumat.btf.synthesis.hex import Hex
from neumat.btf.synthesis.histogram import Histogram
from neumat.btf.synthesis.linear import Linear
from neumat.btf.synthesis.quilting import Quilting
from neumat.btf.synthesis.tiling import Tiling

SYNTHESES = {
    "tiling": Tiling,
    "linear": Linear,
    "histogram": Histogram,
    "hex": Hex,
    "quilting": Quilting,
    "autocovariance": Autocovariance,
    "corner": Corner,
}
