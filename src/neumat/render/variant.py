"""Which variant of Mitsuba works here.

Mitsuba is imported on first use: which variant works depends on the LLVM library that Dr.Jit loads at import.
"""

import ctypes.util
import functools
import importlib.metadata
import os
import subprocess
import sys
import time

import torch

# Some LLVM versions abort the process at the first render, and CUDA is no use without OptiX: so each is first tried,
# in another process.
PROBE = (
    "import sys, mitsuba as mi; mi.set_variant(sys.argv[1]);"
    "print(mi.render(mi.load_dict({'type': 'scene', 's': {'type': 'sphere'}, 'e': {'type': 'constant'},"
    "'i': {'type': 'path'}, 'c': {'type': 'perspective', 'f': {'type': 'hdrfilm', 'width': 4, 'height': 4}}}), spp=1))"
)


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
    command = [sys.executable, "-c", PROBE, name]
    return subprocess.run(command, env=os.environ | environment, capture_output=True).returncode == 0


@functools.cache
def variant():
    """Return the best Mitsuba variant that renders here: "cuda_ad_rgb", "llvm_ad_rgb", else "scalar_rgb"."""
    llvm = next((path for path in _llvm_libraries() if _renders("llvm_ad_rgb", DRJIT_LIBLLVM_PATH=path)), None)
    if llvm:  # with CUDA too, for who sets LLVM's variant later
        os.environ["DRJIT_LIBLLVM_PATH"] = llvm
    if torch.cuda.is_available() and _renders("cuda_ad_rgb"):
        return "cuda_ad_rgb"
    return "llvm_ad_rgb" if llvm else "scalar_rgb"


def clock():
    """Return the time, s, by which Mitsuba's work is timed: the CPU's, which others on the machine disturb least; where
    a GPU does the work, the wall's."""
    return time.perf_counter() if variant() == "cuda_ad_rgb" else time.process_time()
