import os
import subprocess
import sys

import pytest
import torch

from neumat.errors import NeumatError
from neumat.render import variant as module

GOOD, OLD, NONE = "23 1 4", "15 0 6", "-1 -1 -1"  # versions of LLVM


@pytest.fixture
def machine(monkeypatch):
    """Return a function that feigns a machine: which variants render with the library "good", none with others, and
    which version Dr.Jit has loaded (None: it is not imported)."""
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "before")
    monkeypatch.setattr(module, "_llvm_libraries", lambda: iter(["broken", "good"]))

    def feign(working, loaded=None, gpu=False, replaces=True):
        def renders(name, DRJIT_LIBLLVM_PATH=None):
            path = DRJIT_LIBLLVM_PATH or os.environ["DRJIT_LIBLLVM_PATH"]
            return GOOD if name in working and (path == "good" or name.startswith("cuda")) else ""

        monkeypatch.setattr(torch.cuda, "is_available", lambda: gpu)
        monkeypatch.setattr(module, "_renders", renders)
        monkeypatch.setattr(module, "_loaded_version", lambda: loaded)
        monkeypatch.setattr(module, "_load_instead", lambda version: replaces)
        monkeypatch.setattr(module, "llvm", module.llvm.__wrapped__)

    return feign


@pytest.mark.parametrize(
    ("gpu", "working", "expected"),
    [
        (True, {"cuda_ad_rgb", "llvm_ad_rgb"}, "cuda_ad_rgb"),
        (True, {"llvm_ad_rgb"}, "llvm_ad_rgb"),  # a GPU without OptiX
        (False, {"cuda_ad_rgb", "llvm_ad_rgb"}, "llvm_ad_rgb"),
        (True, set(), "scalar_rgb"),
    ],
)
def test_the_best_variant_that_renders(machine, gpu, working, expected):
    machine(working, gpu=gpu)
    assert module.variant.__wrapped__() == expected
    # Also for who sets LLVM's variant where CUDA is the best.
    assert os.environ["DRJIT_LIBLLVM_PATH"] == ("good" if "llvm_ad_rgb" in working else "before")


def test_another_llvm_takes_the_place_of_one_that_cannot_render(machine):
    machine({"llvm_ad_rgb"}, loaded=OLD)
    assert module.variant.__wrapped__() == "llvm_ad_rgb"
    module.check_llvm("llvm_ad_rgb")


def test_a_path_that_is_set_after_the_import_does_not_count_as_loaded(machine, monkeypatch):
    machine({"llvm_ad_rgb"}, loaded=OLD, replaces=False)
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "good")
    with pytest.raises(NeumatError):
        module.check_llvm("llvm_ad_rgb")


@pytest.mark.parametrize("loaded", [OLD, NONE])
def test_where_none_takes_its_place_one_line_says_what_to_do(machine, loaded, caplog):
    machine({"llvm_ad_rgb"}, loaded=loaded, replaces=False)
    assert module.variant.__wrapped__() == "scalar_rgb"
    assert len(caplog.messages) == 1 and "import neumat first" in caplog.text
    for name in ("scalar_rgb", "cuda_ad_rgb", "scalar_spectral"):
        module.check_llvm(name)
    for name in ("llvm_ad_rgb", "llvm_ad_mono"):
        with pytest.raises(NeumatError, match="import neumat first, or set DRJIT_LIBLLVM_PATH") as caught:
            module.check_llvm(name)
        assert "\n" not in str(caught.value)


RENDER = """
scene = mi.load_dict({"type": "scene", "i": {"type": "path"}, "e": {"type": "constant"},
    "s": {"type": "sphere", "b": {"type": "glossy", "parameters": "0.2 0.1 0.1 0.04 0.04 0.04 0.2"}},
    "c": {"type": "perspective", "f": {"type": "hdrfilm", "width": 4, "height": 4},
          "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])}})
assert 0 < mi.render(scene, spp=4).numpy().mean() < 1
"""


@pytest.mark.parametrize("path", [None, "no-such-library.so"])
def test_mitsuba_may_be_imported_first(path):
    environment = {key: value for key, value in os.environ.items() if key != "DRJIT_LIBLLVM_PATH"}
    if path:
        environment["DRJIT_LIBLLVM_PATH"] = path
    run = subprocess.run(
        [sys.executable, "-c", "import mitsuba as mi, neumat.mitsuba" + RENDER],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr


def test_a_variant_set_before_renders_or_says_what_to_do():
    environment = {key: value for key, value in os.environ.items() if key != "DRJIT_LIBLLVM_PATH"}
    code = """
import mitsuba as mi
try: mi.set_variant("llvm_ad_rgb")
except ImportError: raise SystemExit  # no LLVM: Mitsuba itself says so
{}
from neumat.errors import NeumatError
try: import neumat.mitsuba
except NeumatError as error:
    assert "import neumat first" in str(error)
    raise SystemExit
"""
    for before in ("", "bsdf = mi.load_dict({'type': 'diffuse'})"):
        run = subprocess.run([sys.executable, "-c", code.format(before) + RENDER], env=environment, capture_output=True)
        assert run.returncode == 0, run.stderr
