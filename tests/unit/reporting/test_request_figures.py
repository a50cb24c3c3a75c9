from types import SimpleNamespace

import numpy as np
import pandas as pd
import torch
from PIL import Image

from neumat.reporting import conditional
from neumat.reporting.request_figures import guidance_chart, request_sheet


def test_a_sheet_shows_what_was_asked_before_what_came(tmp_path):
    pictures = np.zeros((3, 2, 24, 24, 3), np.uint8)
    pictures[..., 1] = 255
    shown = np.zeros((3, 48, 48, 3), np.uint8)
    shown[..., 0] = 255
    request_sheet(["a", "b", "c"], pictures, tmp_path / "sheet.png", shown)
    image = np.asarray(Image.open(tmp_path / "sheet.png").convert("RGB")).astype(int)
    red, green = ((image[..., k] > 200) & (image.sum(2) < 300) for k in (0, 1))
    assert 1.8 < green.sum() / red.sum() < 2.3  # two answers to each request
    assert np.nonzero(red.any(0))[0][0] < np.nonzero(green.any(0))[0][0]


def test_pictures_are_not_enlarged(tmp_path):
    pictures = np.full((4, 5, 128, 128, 3), 90, np.uint8)
    request_sheet(["a", "b", "c", "d"], pictures, tmp_path / "sheet.png")
    assert Image.open(tmp_path / "sheet.png").size[0] == 2 * 5 * 128


def test_the_guidance_chart_is_drawn_even_where_nothing_is_valid(tmp_path):
    columns = ("type_right", "colour_right", "gloss_right", "image_rmse", "diversity", "nearest", "invalid")
    table = pd.DataFrame({"guidance": [-1.0, 0.0, 4.0], **{name: [0.1, 0.5, np.nan] for name in columns}})
    guidance_chart(table, [0.0, 4.0], tmp_path / "guidance.png")
    assert Image.open(tmp_path / "guidance.png").size[0] > 1000
    assert (tmp_path / "guidance.svg").stat().st_size > 5000


def test_what_could_not_be_asked_for_is_said_on_its_page_and_in_the_chart(tmp_path, monkeypatch):
    """The user's own materials have no types: a page says so, the others are drawn."""
    drawn = []
    monkeypatch.setattr(conditional, "request_figure", lambda requests, weights, *_: drawn.append((requests, weights)))
    asked = [(SimpleNamespace(modality=name), k) for k, name in enumerate(["text", "text", "image"])]
    conditional.write_figures(asked, 8, 1, {name: tmp_path / f"{name}.png" for name in ("type", "text", "image")})
    assert drawn == [asked[0], asked[2]]
    assert Image.open(tmp_path / "type.png").size[0] > 100
    columns = ("colour_right", "gloss_right", "image_rmse", "diversity", "nearest", "invalid")
    table = pd.DataFrame({"guidance": [0.0, 1.0], "type_right": np.nan, **{name: [0.1, 0.5] for name in columns}})
    guidance_chart(table, [1.0], tmp_path / "guidance.png")
    assert "not measured" in (tmp_path / "guidance.svg").read_text()


def test_a_category_of_which_little_was_found_leaves_its_row_empty(tmp_path, monkeypatch):
    red = np.zeros((8, 8, 3), np.uint8)
    red[..., 0] = 255
    monkeypatch.setattr(conditional, "render_grid", lambda weights, columns, *_: np.tile(red, (1, columns, 1)))
    found = {"diffuse": torch.zeros(6, 675), "mirror": torch.zeros(2, 675), "metallic": torch.zeros(0, 675)}
    conditional.category_figure(found, 8, 1, tmp_path / "sheet.png")
    image = np.asarray(Image.open(tmp_path / "sheet.png").convert("RGB")).astype(int)
    drawn = (image[..., 0] > 200) & (image.sum(2) < 300)
    left, right = drawn[:, : drawn.shape[1] // 2].sum(), drawn[:, drawn.shape[1] // 2 :].sum()
    assert 2.2 < left / right < 2.8  # five of six, beside two; nothing below
