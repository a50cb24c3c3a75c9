import math

import numpy as np
import pytest
import torch
from PIL import Image

from neumat.conditions.photos import SIZE, augmented, check_picture, read_photo, turned
from neumat.errors import NeumatError
from neumat.render import scene

RNG = np.random.default_rng(0)
NOISE = RNG.integers(0, 256, (90, 60, 3), dtype=np.uint8)


def save(tmp_path, image, name="photo.png"):
    path = tmp_path / name
    image.save(path)
    return path


def test_the_central_square_is_what_counts(tmp_path):
    wide = np.zeros((64, 192, 3), np.uint8)
    wide[:, 64:128, 0] = 200
    wide[:32, 64:128, 1] = 100
    pixels = read_photo(save(tmp_path, Image.fromarray(wide)))
    assert pixels.shape == (SIZE, SIZE, 3) and pixels.dtype == torch.uint8
    assert (pixels[..., 0] == 200).all()
    assert (pixels[: SIZE // 2 - 1, :, 1] == 100).all() and (pixels[SIZE // 2 + 1 :, :, 1] == 0).all()


def test_unusual_formats_read_as_what_they_show(tmp_path):
    grey = np.asarray(Image.fromarray(NOISE).convert("L"))
    expected = read_photo(save(tmp_path, Image.fromarray(grey), "grey.png")).int()
    sixteen = save(tmp_path, Image.fromarray(grey.astype(np.uint16) * 257), "sixteen.png")
    assert (read_photo(sixteen).int() - expected).abs().max() <= 1
    clear = np.dstack([NOISE, np.full((90, 60), 255, np.uint8)])
    clear[:45, :, 3] = 0
    pixels = read_photo(save(tmp_path, Image.fromarray(clear, "RGBA"), "alpha.png"))
    assert (pixels[: SIZE // 3] == 119).all()  # transparent parts are mid grey, whatever colour hides there
    big = save(tmp_path, Image.fromarray(NOISE).resize((3000, 4500)), "big.jpg")
    assert read_photo(big).shape == (SIZE, SIZE, 3)


@pytest.mark.parametrize(
    ("picture", "expected"),
    [
        (np.zeros((64, 64, 3), np.uint8), "one even colour"),
        (np.full((64, 64, 3), 255, np.uint8), "one even colour"),
        (NOISE[:8, :8], "at least 16 x 16"),
    ],
)
def test_pictures_that_show_nothing_are_refused(tmp_path, picture, expected):
    with pytest.raises(NeumatError, match=expected):
        read_photo(save(tmp_path, Image.fromarray(picture)))


def test_lights_turn_with_the_environment():
    directions = torch.nn.functional.normalize(torch.randn(50, 3, generator=torch.Generator().manual_seed(0)), dim=1)
    assert torch.allclose(turned(0.0, 0.0)(directions), scene.environment(directions))
    half = turned(math.pi, 0.0)(directions * torch.tensor([-1.0, 1.0, -1.0]))
    assert torch.allclose(half, scene.environment(directions), atol=1e-5)


def test_augmented_pictures_lie_within_the_sphere():
    size = 64
    axis = ((torch.arange(size) + 0.5) / size * 2 - 1) / scene.RADIUS
    inside = torch.hypot(axis[:, None], axis) < 1.15
    linear = torch.where(inside[..., None], 0.2, 0.0).expand(40, -1, -1, 3)
    pictures = augmented(linear, 0, "test")
    assert pictures.shape == (40, SIZE, SIZE, 3)
    centre = pictures[:, SIZE // 4 : -SIZE // 4, SIZE // 4 : -SIZE // 4]
    assert (centre > 60).all()
    assert torch.equal(pictures, augmented(linear, 0, "test"))
    assert not torch.equal(pictures, augmented(linear, 0, "other"))


def test_orientation_colour_spaces_and_palettes_read_as_what_they_show(tmp_path):
    picture = Image.new("RGB", (64, 64), (250, 0, 0))
    picture.paste((0, 0, 250), (0, 32, 64, 64))
    expected = read_photo(save(tmp_path, picture)).int()
    orientation = Image.Exif()
    orientation[0x0112] = 6  # shown a quarter turn clockwise from how it is stored
    path = tmp_path / "turned.jpg"
    picture.rotate(90).save(path, exif=orientation, quality=95)
    assert (read_photo(path).int() - expected).abs().float().mean() < 4
    assert (read_photo(save(tmp_path, picture.convert("CMYK"), "cmyk.jpg")).int() - expected).abs().float().mean() < 4
    palette = picture.convert("P", palette=Image.Palette.ADAPTIVE)
    path = tmp_path / "palette.png"
    palette.save(path, transparency=palette.getpixel((0, 0)))
    pixels = read_photo(path).int()
    assert (pixels[: SIZE // 2 - 1] == 119).all() and torch.equal(pixels[SIZE // 2 + 1 :], expected[SIZE // 2 + 1 :])


def test_deep_grey_is_scaled_by_what_it_holds_and_refused_where_not_finite(tmp_path):
    grey = RNG.random((40, 40))
    expected = read_photo(save(tmp_path, Image.fromarray((grey / grey.max() * 255).round().astype(np.uint8)))).int()
    deep = Image.fromarray((grey / grey.max() * (2**31 - 1)).astype(np.int32))
    assert (read_photo(save(tmp_path, deep, "deep.tif")).int() - expected).abs().max() <= 1
    for value in (np.nan, np.inf):
        grey[3, 3] = value
        with pytest.raises(NeumatError, match="not finite"):
            read_photo(save(tmp_path, Image.fromarray(grey.astype(np.float32)), "broken.tif"))


def test_a_picture_in_memory_is_checked_as_a_file_is():
    check_picture("image", torch.from_numpy(NOISE))
    for picture, expected in (
        (torch.from_numpy(NOISE) / 255, "uint8"),
        (torch.from_numpy(NOISE[..., 0]), "uint8"),
        (torch.zeros(64, 64, 3, dtype=torch.uint8), "one even colour"),
        (torch.from_numpy(NOISE[:8]), r"at least 16 x 16 pixels; found \(60, 8\)"),
    ):
        with pytest.raises(NeumatError, match=expected):
            check_picture("image", picture)
