"""Which variant of Mitsuba works here.

Mitsuba is imported on first use: which variant works depends on the LLVM library that Dr.Jit loads at import.
"""

import ctypes.util
import functools
import importlib.metadata
import os
import subprocess
import sys

# Some LLVM versions abort the process at the first render, so each library is first tried in another process.
PROBE = (
    "import mitsuba as mi; mi.set_variant('llvm_ad_rgb');"
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


@functools.cache
def variant():
    """Return the best Mitsuba variant, after a trial in another process: "llvm_ad_rgb", else "scalar_rgb"."""
    for path in _llvm_libraries():
        environment = {**os.environ, "DRJIT_LIBLLVM_PATH": path}
        if subprocess.run([sys.executable, "-c", PROBE], env=environment, capture_output=True).returncode == 0:
            os.environ["DRJIT_LIBLLVM_PATH"] = path
            return "llvm_ad_rgb"
    return "scalar_rgb"
