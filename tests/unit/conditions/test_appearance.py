import torch

from neumat.conditions.appearance import AppearanceRegression, rendered_appearance
from neumat.seeds import torch_generator


def test_looks_are_told_whatever_the_exposure(lambert):
    """Features hold the colour times an exposure, and the exposure: the product rule is learnt near enough."""
    generator = torch_generator(0, "looks")
    colours = torch.rand(200, 3, generator=generator) * 0.5 + 0.1
    exposure = torch.exp(0.3 * torch.randn(200, 4, generator=generator))
    images = torch.cat([(colours[:, None] * exposure[..., None]).log(), exposure[..., None].log()], 2)
    seen = rendered_appearance(lambert(*colours.tolist()))
    assert seen.min() >= 0
    assert seen.max() <= 1
    told = AppearanceRegression.fit(images[:150], seen[:150])(images[150:].flatten(0, 1))
    error = (told - seen[150:].repeat_interleave(4, 0)).square().mean().sqrt()
    spread = (seen[150:] - seen.mean(0)).square().mean().sqrt()
    assert error < 0.15 * spread


def test_a_picture_in_the_cameras_light_is_the_permuted_one_of_a_permuted_colour(lambert):
    first, second = rendered_appearance(lambert((0.5, 0.2, 0.1), (0.1, 0.5, 0.2)))
    assert torch.equal(first.view(-1, 3)[:, [2, 0, 1]], second.view(-1, 3))


def test_what_training_hardly_shows_does_not_decide(lambert):
    """Photos show what spheres do not: a feature that is all but constant in training, where it follows red."""
    generator = torch_generator(0, "rare")
    colours = torch.rand(200, 3, generator=generator) * 0.5 + 0.1
    images = torch.cat([colours, 1e-3 * colours[:, :1]], 1)[:, None]
    seen = rendered_appearance(lambert(*colours.tolist()))
    ordinary = images[0]
    photo = ordinary + torch.tensor([0.0, 0.0, 0.0, 1.0])
    told = AppearanceRegression.fit(images, seen)
    assert (told(photo) - told(ordinary)).abs().max() < 0.05
