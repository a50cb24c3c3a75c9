import os

import pytest
import torch

from neumat.render import variant as module


@pytest.mark.parametrize(
    ("gpu", "working", "expected"),
    [
        (True, {"cuda_ad_rgb", "llvm_ad_rgb"}, "cuda_ad_rgb"),
        (True, {"llvm_ad_rgb"}, "llvm_ad_rgb"),  # a GPU without OptiX
        (False, {"cuda_ad_rgb", "llvm_ad_rgb"}, "llvm_ad_rgb"),
        (True, set(), "scalar_rgb"),
    ],
)
def test_the_best_variant_that_renders(monkeypatch, gpu, working, expected):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "before")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: gpu)
    monkeypatch.setattr(module, "_llvm_libraries", lambda: iter(["broken", "good"]))
    monkeypatch.setattr(
        module,
        "_renders",
        lambda name, DRJIT_LIBLLVM_PATH=None: name in working and DRJIT_LIBLLVM_PATH != "broken",
    )
    assert module.variant.__wrapped__() == expected
    # Also for who sets LLVM's variant where CUDA is the best.
    assert os.environ["DRJIT_LIBLLVM_PATH"] == ("good" if "llvm_ad_rgb" in working else "before")
