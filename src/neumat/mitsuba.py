"""All plugins of this package for Mitsuba 3: importing this module registers them.

import neumat.mitsuba
import mitsuba as mi

Import it before Mitsuba, so that Dr.Jit loads an LLVM that works (see `neumat.render.variant`). What the plugins take
is said in `neumat.render.mitsuba_bsdf` and `neumat.btf.mitsuba_btf`.
"""

from neumat.btf import mitsuba_btf  # noqa: F401 - registers
from neumat.render.mitsuba_bsdf import load_dict

__all__ = ["load_dict"]
