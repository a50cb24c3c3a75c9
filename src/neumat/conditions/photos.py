"""Pictures as conditions: a user's image files, and renders of the training materials made as varied as photos."""

import math

import torch

from neumat.conditions.image_files import read_square
from neumat.errors import NeumatError
from neumat.render import scene
from neumat.seeds import torch_generator

SIZE = 128  # pixels of a picture before encoding
SPHERE = 96, 48, 64  # pixels, rings and azimuths of the pictures of fields that are cropped
SMALLEST, FLATTEST = 16, 2 / 255  # pixels along the shorter side; standard deviation of an image that shows something
EXPOSURES, BALANCE = 0.7, 0.08  # stops to either side; standard deviation of the log gain of each channel
GOLDEN = 2.399963  # rad, the golden angle
TILT = 0.4  # rad, up and down in turn
CROPS = (0.35, 1.0)  # side of the crop as a share of the sphere's diameter


def read_photo(path):
    """Return an image file as uint8 sRGB (SIZE, SIZE, 3): its central square, transparency on mid grey.

    Any format, colour space, bit depth and orientation that `image_files` reads. Raises NeumatError for a missing,
    truncated or foreign file, values that are not finite, and a picture that shows nothing (see `check_picture`).
    """
    pixels = torch.from_numpy(read_square(path, SIZE, SMALLEST))
    check_picture(path, pixels)
    return pixels


def check_picture(where, pixels):
    """Raise NeumatError for what is no uint8 tensor (H, W, 3), for less than SMALLEST pixels along a side, and for a
    picture that shows nothing (a single brightness)."""
    if pixels.dtype != torch.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3:
        raise NeumatError(where, "a picture, uint8 (H, W, 3)", f"{pixels.dtype} {tuple(pixels.shape)}")
    if min(pixels.shape[:2]) < SMALLEST:
        size = (pixels.shape[1], pixels.shape[0])
        raise NeumatError(where, f"an image of at least {SMALLEST} x {SMALLEST} pixels", size)
    if (pixels / 255).std() < FLATTEST:
        raise NeumatError(where, "a picture of a material", f"one even colour, {tuple(pixels[0, 0].tolist())}")


def turned(turn, tilt):
    """Return `scene.environment` turned by `turn` about y, then by `tilt` about x (rad): another photo's lighting."""
    cos_t, sin_t, cos_x, sin_x = math.cos(turn), math.sin(turn), math.cos(tilt), math.sin(tilt)
    about_y = torch.tensor([[cos_t, 0, sin_t], [0, 1, 0], [-sin_t, 0, cos_t]], dtype=torch.float64)
    about_x = torch.tensor([[1, 0, 0], [0, cos_x, -sin_x], [0, sin_x, cos_x]], dtype=torch.float64)

    def environment(directions):
        rotation = (about_x @ about_y).to(directions.dtype)
        return scene.environment(directions @ rotation)

    return environment


def lighting(k):
    """Return the environment number k: 0 is the scene's own, the others are turned by multiples of the golden angle, so
    that any few in a row are well spread."""
    return turned(GOLDEN * k, TILT * (k > 0) * (-1) ** k)


def augmented(linear, seed, *names):
    """Return uint8 sRGB (n, SIZE, SIZE, 3) of linear pictures (n, S, S, 3) of spheres: cropped about a random centre
    within the sphere, exposed and white-balanced at random, as photos are. Random numbers by `seed` and `names`."""
    n = len(linear)
    generator = torch_generator(seed, "photos", *names)
    u = torch.rand(n, 5, generator=generator)
    side = (CROPS[0] + (CROPS[1] - CROPS[0]) * u[:, 0]) * scene.RADIUS
    reach = (scene.RADIUS - side) * u[:, 1].sqrt()  # the crop's inscribed circle stays on the sphere
    centre = reach[:, None] * torch.stack([(2 * math.pi * u[:, 2]).cos(), (2 * math.pi * u[:, 2]).sin()], 1)
    axis = (torch.arange(SIZE) + 0.5) / SIZE * 2 - 1
    y, x = torch.meshgrid(axis, axis, indexing="ij")
    grid = torch.stack([x, y], -1) * side[:, None, None, None] + centre[:, None, None]
    pictures = torch.nn.functional.grid_sample(
        linear.permute(0, 3, 1, 2), grid, mode="bilinear", padding_mode="border", align_corners=False
    )
    gain = 2 ** (EXPOSURES * (2 * u[:, 3:4] - 1)) * torch.exp(BALANCE * torch.randn(n, 3, generator=generator))
    return scene.to_srgb8((pictures * gain[..., None, None]).permute(0, 2, 3, 1))
