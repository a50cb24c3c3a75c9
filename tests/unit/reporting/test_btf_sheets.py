"""Pictures of BTFs."""

import numpy as np
import torch
from PIL import Image

from neumat.reporting.btf_chart import chart_table, relief_table
from neumat.reporting.btf_sheets import error_map, false_colours, picture_grid


def test_false_colours_show_the_largest_variance_in_red():
    plane = torch.zeros(8, 8, 5)
    plane[..., 3] = torch.linspace(0, 1, 8)[:, None]
    shown = false_colours(plane)
    assert shown.shape == (8, 8, 3) and shown.dtype == np.uint8
    assert (np.abs(np.diff(shown[:, 0, 0].astype(int))) > 20).all() and (shown[0] == shown[0, :1]).all()


def test_planes_of_one_channel_and_of_one_value_have_colours():
    assert false_colours(torch.rand(4, 4, 1)).shape == (4, 4, 3)
    assert len(np.unique(false_colours(torch.ones(4, 4, 3)))) == 1


def test_no_error_is_black():
    picture = np.full((16, 16, 3), 128, np.uint8)
    assert error_map(picture, picture).max() < 8 < error_map(picture, 255 - picture // 2 * 2).max()


def test_a_grid_has_room_for_every_picture(tmp_path):
    picture = np.zeros((8, 8, 3), np.uint8)
    picture_grid(["a", "b"], ["one", "two", "three"], [[picture] * 3, [None, picture, picture]], tmp_path / "grid.png")
    width, height = Image.open(tmp_path / "grid.png").size
    assert width > 3 * 200 and height > 2 * 200


def rows(tmp_path, surface, representation):
    path = tmp_path / f"{surface}-{representation}.csv"
    lines = [f'"{surface}",{pairs},{representation},{flip}' for pairs, flip in (("validation", 0.5), ("report", 0.25))]
    path.write_text("surface,pairs,representation,flip\n" + "\n".join(lines) + "\n")
    return path


def test_a_chart_is_of_the_report_and_names_what_differs(tmp_path):
    fits = [("leather", "ours"), ("leather", "pca"), ("leather", "ours@width=16"), ("leather@texels=64", "ours")]
    table = chart_table([rows(tmp_path, *fit) for fit in fits])
    assert list(table["setting"]) == ["ours", "pca", "width=16", "plane=64"]
    assert list(table["varied"]) == ["representation", "representation", "width", "plane"]
    assert (table["flip"] == 0.25).all()


def test_a_table_of_relief_has_the_factor(tmp_path):
    table = relief_table([rows(tmp_path, "weave@relief=0.5,texels=64", "neumip@samples=10")])
    assert table.iloc[0].to_dict() == {
        "surface": "weave",
        "relief": 0.5,
        "pairs": "report",
        "representation": "neumip",
        "flip": 0.25,
    }
