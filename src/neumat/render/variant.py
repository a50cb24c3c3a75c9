"""Which variant of Mitsuba works here, and the LLVM library that it works with.

Dr.Jit loads LLVM once, at import: so Mitsuba is imported on first use, after a library that works has been found.
"""

import ctypes
import ctypes.util
import functools
import importlib.metadata
import logging
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import torch

from neumat.errors import NeumatError

# Some LLVM versions abort the process at the first render, and CUDA is no use without OptiX: so each is first tried,
# in another process.
PROBE = (
    "import sys, drjit, mitsuba as mi; mi.set_variant(sys.argv[1]);"
    "mi.render(mi.load_dict({'type': 'scene', 's': {'type': 'sphere'}, 'e': {'type': 'constant'},"
    "'i': {'type': 'path'}, 'c': {'type': 'perspective', 'f': {'type': 'hdrfilm', 'width': 4, 'height': 4}}}),"
    "spp=1).numpy();"
    "print(*drjit.detail.llvm_version())"
)
ARRAYS = (
    "import sys, drjit, mitsuba as mi; from neumat.render.variant import live_arrays;"
    "[mi.set_variant(name) for name in sys.argv[1:]]; print(live_arrays())"
)
ADVICE = "import neumat first, or set DRJIT_LIBLLVM_PATH to the shared library of LLVM 17 or later"
ALL_BACKENDS = 0xFFFFFFFF  # bit mask


def _llvm_libraries():
    """Yield candidate paths of LLVM's shared library: the user's choice, the Python package, the system's."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        yield os.environ["DRJIT_LIBLLVM_PATH"]
    try:
        files = importlib.metadata.files("karellen-llvm-core") or []
        yield from (str(file.locate().resolve()) for file in files if file.name == "libLLVM.so")
    except importlib.metadata.PackageNotFoundError:
        pass
    yield from filter(None, (ctypes.util.find_library(f"LLVM-{version}") for version in range(23, 16, -1)))


def _renders(name, **environment):
    """Return the version of LLVM of a process that renders with the variant `name`, a text; "" where it fails."""
    command = [sys.executable, "-c", PROBE, name]
    run = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True)
    return "" if run.returncode else run.stdout.strip()


def _loaded_version():
    """Return the version of LLVM that Dr.Jit has loaded, as `_renders` does; None before it is imported."""
    drjit = sys.modules.get("drjit")
    return drjit and " ".join(map(str, drjit.detail.llvm_version()))


@functools.cache
def llvm():
    """Return whether LLVM's variants render here, with the library that Dr.Jit has loaded, or will load at import.

    Where that one fails (some abort the process), or there is none, another is looked for and loaded in its place.
    """
    loaded = _loaded_version()
    if loaded and _renders("llvm_ad_rgb") == loaded:
        return True
    for path in _llvm_libraries():
        version = _renders("llvm_ad_rgb", DRJIT_LIBLLVM_PATH=path)
        if version:
            os.environ["DRJIT_LIBLLVM_PATH"] = path
            break
    else:
        return False
    return not loaded or _load_instead(version)


def live_arrays():
    """Return how many arrays Dr.Jit holds."""
    return len(re.findall(r"^ +[0-9]+ +[A-Z]", sys.modules["drjit"].whos(True), re.MULTILINE))


def _load_instead(version):
    """Make Dr.Jit, already imported, load the LLVM that DRJIT_LIBLLVM_PATH names; return whether it has.

    Python is given no function for it: these two are of drjit-core's interface (jit.h). Scenes loaded before would be
    lost, so where arrays live but those that Mitsuba makes when a variant is set, nothing is done.
    """
    import mitsuba as mi

    arrays = [sys.executable, "-c", ARRAYS, *filter(None, [mi.variant()])]
    if subprocess.run(arrays, capture_output=True, text=True).stdout != f"{live_arrays()}\n":
        return False
    try:
        core = ctypes.CDLL(str(next(Path(sys.modules["drjit"].__file__).parent.glob("*drjit-core.*"))))
        core._Z12jit_shutdowni(0)
        core._Z8jit_initj(ALL_BACKENDS)
    except (AttributeError, OSError, StopIteration):  # another build of Dr.Jit, or another system
        return False
    return _loaded_version() == version


def check_llvm(name):
    """Raise NeumatError where `name`, the variant of Mitsuba that is set, needs LLVM and would abort the process."""
    if name.startswith("llvm") and not llvm():
        raise NeumatError(name, "an LLVM that can render", f"none loaded: {ADVICE}, or set scalar_rgb")


@functools.cache
def variant():
    """Return the best Mitsuba variant that renders here: "cuda_ad_rgb", "llvm_ad_rgb", else "scalar_rgb"."""
    loaded, with_llvm = _loaded_version(), llvm()  # with CUDA too, for who sets LLVM's variant later
    if torch.cuda.is_available() and _renders("cuda_ad_rgb"):
        return "cuda_ad_rgb"
    if loaded and not with_llvm:
        logging.warning("scalar_rgb is used: Mitsuba was imported with no LLVM that can render; %s", ADVICE)
    return "llvm_ad_rgb" if with_llvm else "scalar_rgb"


def clock():
    """Return the time, s, by which Mitsuba's work is timed: the CPU's, which others on the machine disturb least; where
    a GPU does the work, the wall's."""
    return time.perf_counter() if variant() == "cuda_ad_rgb" else time.process_time()
