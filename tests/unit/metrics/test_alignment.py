import inspect
import math

import pytest
import torch

from neumat.brdf.coordinates import grid_angles
from neumat.errors import NeumatError
from neumat.fields.field import evaluate
from neumat.fields.layout import permute_channels
from neumat.metrics.alignment import diversity, new_environment, rendered_distance
from neumat.metrics.materials import MaterialSet
from neumat.render.sphere import FrozenSphere, render_fields


@pytest.fixture(scope="module")
def frozen():
    return FrozenSphere(24, rings=12, azimuths=24, environment=new_environment)


def test_equal_materials_are_at_no_distance_and_colours_far(frozen, field):
    red = field(albedo=(0.25, 0.02, 0.02), peak=5.0)
    weights = torch.stack([red, permute_channels(red, "gbr")])
    rmse, psnr = rendered_distance(frozen, weights, red.expand(2, -1))
    assert rmse[0] == 0 and psnr[0] == pytest.approx(10 * math.log10(255**2 * 24 * 24 * 3))
    assert rmse[1] > 0.1 and psnr[1] == pytest.approx(-20 * math.log10(rmse[1]))


def test_pictures_serve_as_targets(frozen, field):
    weights = torch.stack([field(albedo=0.1), field(albedo=0.3)])
    pictures = render_fields(frozen, weights)
    assert (rendered_distance(frozen, weights, pictures)[0] == 0).all()
    with pytest.raises(NeumatError, match=r"targets: expected .*; found"):
        rendered_distance(frozen, weights, pictures[:1])


def test_the_new_lighting_is_another_one():
    normal = torch.nn.functional.normalize(torch.randn(500, 3, generator=torch.Generator().manual_seed(0)), dim=1)
    old = inspect.signature(FrozenSphere).parameters["environment"].default(normal)
    assert torch.corrcoef(torch.stack([old, new_environment(normal)]))[0, 1] < 0.3


def test_diversity_is_the_mean_over_pairs(field):
    entries = torch.arange(0, 100) * 97
    weights = torch.stack([field(albedo=math.pi * math.expm1(x)) for x in (0.0, 0.1, 0.4)])
    materials = MaterialSet(entries, evaluate(weights, *grid_angles(entries)))
    lit = (materials.brdf[1] > 0).float().mean().item()
    assert diversity(materials) == pytest.approx(lit * (0.1 + 0.3 + 0.4) / 3, rel=1e-4)
    assert math.isnan(diversity(materials[:1]))
    broken = MaterialSet(entries, torch.cat([materials.brdf[:2], torch.full((1, 100, 3), math.nan)]))
    assert diversity(broken) == pytest.approx(lit * 0.1, rel=1e-4)
