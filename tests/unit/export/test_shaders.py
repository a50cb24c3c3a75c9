"""The shading languages: compiled, run, and compared with our own evaluation. A software driver will do."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from run_shader import NO_DRIVER

from neumat.brdf.coordinates import rusinkiewicz
from neumat.export import export
from neumat.export.shader import function_name
from neumat.fields.field import Field

LANGUAGES = ["glsl", "wgsl"]
RUNNER = Path(__file__).with_name("run_shader.py")
NAME = "blend-000@rbg"


def run(weights, language, wi, wo, folder):
    """Return the shader's f (n, 3), float32, at directions (n, 3); skips the test where it can't be run."""
    source = export(weights, language, folder, NAME)
    files = [folder / "directions.npy", folder / "result.npy"]
    np.save(files[0], torch.nn.functional.pad(torch.stack([wi, wo], 1), (0, 1)).float().numpy())
    command = [sys.executable, RUNNER, source, function_name(NAME), *files]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == NO_DRIVER:
        pytest.skip(f"no package or driver runs {language} here: {done.stdout.strip()}")
    assert done.returncode == 0, done.stderr
    return torch.from_numpy(np.load(files[1])[:, :3].copy())


@pytest.fixture(params=["random", "mirror"])
def weights(request, random_field, field):
    return random_field if request.param == "random" else field(albedo=0.1, peak=1000.0, fall=100.0)


@pytest.mark.parametrize("language", LANGUAGES)
def test_agrees_with_our_evaluation(weights, language, pairs, tmp_path):
    found = run(weights, language, *pairs, tmp_path)
    expected = Field(weights.double()).eval(*rusinkiewicz(*(w.double() for w in pairs)))
    assert (expected > 0.01).any() and (expected == 0).any()
    error = (found - expected).abs() / (1 + expected)
    assert error.max() < 2e-5
    below = (pairs[0][:, 2] <= 0) | (pairs[1][:, 2] <= 0)
    assert below.sum() > 100 and (found[below] == 0).all()


@pytest.mark.parametrize("language", LANGUAGES)
def test_is_reciprocal_to_the_last_bit(random_field, language, pairs, tmp_path):
    wi, wo = (torch.cat([w, w[:200]]) for w in pairs)
    wi[-200:, 1] = wo[-200:, 1] = 0  # in the plane of incidence, where phi_d jumps from pi to 0
    there, back = run(random_field, language, wi, wo, tmp_path), run(random_field, language, wo, wi, tmp_path)
    assert torch.equal(there, back)


@pytest.mark.parametrize("language", LANGUAGES)
def test_known_directions(random_field, language, tmp_path):
    """Along the normal, and half vectors so near it that their azimuth is lost."""
    wi = torch.tensor([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1e-9, 0.0, 1.0]])
    wo = torch.tensor([[0.0, 0.0, 1.0], [-0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    found = run(random_field, language, wi, wo, tmp_path)
    theta_d = torch.tensor([0.0, torch.atan2(wi[1, 0], wi[1, 2]), 0.0])
    expected = Field(random_field).eval(torch.zeros(3), theta_d, torch.zeros(3))
    torch.testing.assert_close(found, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("language", LANGUAGES)
def test_source_holds_every_weight_exactly(random_field, language, tmp_path):
    text = export(random_field, language, tmp_path, NAME, source="neumerl.h5").read_text()
    assert "// source: neumerl.h5" in text and f"{function_name(NAME)}(" in text
    literals = re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", text.partition("a0 = ")[2])
    found = {np.float32(number) for number in literals}
    inert = random_field[21:42]  # of the half vector's second component, which is 0
    assert set(random_field.numpy()) - set(inert.numpy()) <= found


NAMES = [
    "红色金属",
    "grün",
    "gr n",
    "steel-a",
    "steel_a",
    "steel a",
    "-",
    "--",
    "金",
    "3M black__tape (2)",
    "it's",
]


def test_function_names_are_valid():
    assert function_name("chrome") == "brdf_chrome"
    assert re.fullmatch("brdf_blend_000_rbg_[0-9a-f]{12}", function_name("blend-000@rbg"))
    for name in NAMES:
        assert re.fullmatch(r"[a-z](_?[A-Za-z0-9])*", function_name(name))


@given(st.lists(st.text(), unique=True, min_size=2, max_size=20))
def test_every_name_has_a_function_of_its_own(names):
    assert len({function_name(name) for name in names + NAMES}) == len(set(names + NAMES))


def test_no_plain_name_has_the_function_of_another():
    assert function_name(function_name("é").rpartition("_")[2]) != function_name("é")


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", NAMES)
def test_source_is_ascii_whatever_the_name(random_field, language, name, tmp_path):
    source = export(random_field, language, tmp_path, name).read_bytes()
    assert source.isascii() and source.splitlines()[0].startswith(b"// name: ")
    assert all(
        line.startswith(b"//") for line in source[: source.index(function_name(name).encode())].splitlines()[:-1]
    )


@pytest.mark.parametrize("language", LANGUAGES)
def test_an_exponent_beyond_float32_stays_finite(language, pairs, field, tmp_path):
    """As the BSDF has it: what is infinite, times light that is 0, would be NaN."""
    weights = field()
    weights[-3:] = torch.tensor([100.0, 80.0, 1.0])
    wi, wo = pairs[0][2000:2100], pairs[1][2000:2100]
    found = run(weights, language, wi, wo, tmp_path)
    lit = ((wi[:, 2] > 0) & (wo[:, 2] > 0)).nonzero()[:, 0]
    expected = torch.expm1(torch.tensor([80.0, 80.0, 1.0])).expand(len(lit), 3)
    torch.testing.assert_close(found[lit], expected, rtol=1e-4, atol=0)
