"""Every synthesis method in Dr.Jit."""

from neumat.btf.compiled.endless import QuiltingPlane, TilingPlane
from neumat.btf.compiled.lattice import AutocovariancePlane, CornerPlane
from neumat.btf.compiled.triangles import HexPlane, HistogramPlane, LinearPlane
from neumat.btf.synthesis import SYNTHESES

PLANES = {
    "tiling": TilingPlane,
    "linear": LinearPlane,
    "histogram": HistogramPlane,
    "hex": HexPlane,
    "quilting": QuiltingPlane,
    "autocovariance": AutocovariancePlane,
    "corner": CornerPlane,
}


def endless_plane(synthesis):
    """Return the endless plane in Dr.Jit of a `Synthesis`."""
    names = {method: name for name, method in SYNTHESES.items()}
    return PLANES[names[type(synthesis)]](synthesis)
