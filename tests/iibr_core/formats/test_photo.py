import math
import os

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb
from iibr_core.formats.images import photo as photo_module
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.picture_source import PictureSource, read_source
from iibr_core.types import ImageSize, InputError
from tests.iibr_core.pictures import write_oiio

RNG = np.random.default_rng(7)
RGB = RNG.integers(0, 256, (13, 17, 3), dtype=np.uint8)
RGBA = np.dstack([RGB, np.full(RGB.shape[:2], 255, np.uint8)])
ORIENTATION = 0x0112
WITHIN = ImageSize(height=24, width=36)


def area_average(linear, size):
    """Slow twin: overlap of every source pixel with every target pixel, in float64."""

    def overlaps(source, target):
        edges = np.arange(target + 1) * source / target
        low = np.maximum(edges[:-1, None], np.arange(source))
        high = np.minimum(edges[1:, None], np.arange(1, source + 1))
        return np.maximum(high - low, 0) * target / source

    rows, columns = overlaps(linear.shape[0], size[0]), overlaps(linear.shape[1], size[1])
    return np.einsum("ij,jkc,lk->ilc", rows, linear.astype(np.float64), columns, optimize=True)


@pytest.mark.parametrize("max_pixels", [10_000, 2500])
def test_nan_is_black_and_infinity_the_largest_value_even_of_later_rows(tmp_path, max_pixels):
    values = np.full((200, 50, 3), 0.5, np.float32)
    values[3, 4], values[5, 6], values[190, 7] = np.inf, (0.5, np.nan, -np.inf), 7.0
    photo = read_photo(write_oiio(tmp_path / "a.exr", values), max_pixels)
    clean = np.nan_to_num(values, nan=0, posinf=7, neginf=0)
    expected = read_photo(write_oiio(tmp_path / "b.exr", clean), max_pixels)
    assert np.array_equal(photo.pixels, expected.pixels)
    note = "2 pixels held NaN or infinity: NaN became black, infinity the largest value there is (7)."
    assert photo.notes[-1] == note
    nothing = read_photo(write_oiio(tmp_path / "c.exr", np.full((3, 3, 3), np.inf, np.float32)))
    assert np.allclose(nothing.pixels, 1)


# Exif 2.3: sides of the upright picture at which the stored row 0 and column 0 lie.
SIDES = {
    1: ("top", "left"), 2: ("top", "right"), 3: ("bottom", "right"), 4: ("bottom", "left"),
    5: ("left", "top"), 6: ("right", "top"), 7: ("right", "bottom"), 8: ("left", "bottom"),
}  # fmt: skip


@pytest.mark.parametrize("orientation", SIDES)
def test_exif_orientation(tmp_path, orientation):
    path = write_oiio(tmp_path / "a.tif", RGB, Orientation=orientation)
    found = np.round(read_photo(path).pixels * 255)
    assert open_picture(path).upright_size == found.shape[:2]
    row_side, column_side = SIDES[orientation]
    edges = {"top": found[0], "bottom": found[-1], "left": found[:, 0], "right": found[:, -1]}
    row, column = edges[row_side], edges[column_side]
    assert np.array_equal(row if column_side in ("left", "top") else row[::-1], RGB[0])
    assert np.array_equal(column if row_side in ("left", "top") else column[::-1], RGB[:, 0])
    smaller = read_photo(path, max_pixels=60)
    sizes = open_picture(path).upright_size, smaller.size
    assert smaller.notes == ("Made smaller by area averaging, from {} to {}.".format(*sizes),)


@pytest.mark.parametrize("max_pixels", [1, 40, 220])
def test_downsampling_averages_linear_light_by_area(tmp_path, max_pixels):
    photo = read_photo(write_oiio(tmp_path / "a.png", RGB), max_pixels=max_pixels)
    assert photo.pixels.shape[0] * photo.pixels.shape[1] <= max_pixels
    expected = area_average(linear_from_srgb(RGB / 255), photo.size)
    assert np.allclose(linear_from_srgb(photo.pixels), expected, atol=2e-5)
    assert "17x13" in photo.notes[0]


KINDS = {
    "deep.png": {"kind": "uint16"},
    "strips.tif": {"kind": "uint8", "tiff__RowsPerStrip": 7},
    "tiles.tif": {"kind": "uint16", "tile": 64},
    "tiles.exr": {"kind": "float", "tile": 32},
    "lines.jpg": {"kind": "uint8"},
    "alpha.tif": {"kind": "uint8", "tile": 64},
}


@pytest.mark.parametrize("name", KINDS)
def test_large_pictures_are_made_smaller_band_by_band(tmp_path, monkeypatch, name):
    """The bands of a file are its rows; few rows at a time give the same averages."""
    values = np.random.default_rng(4).random((333, 287, 4 if "alpha" in name else 3), np.float32)
    path = write_oiio(tmp_path / name, values, **KINDS[name])
    whole = open_picture(path).decode()
    assert np.array_equal(np.concatenate([band.pixels for band in open_picture(path).bands()]), whole.pixels)
    monkeypatch.setattr(photo_module, "MAX_BAND_PIXELS", 3000)
    for size in ((100, 86), (332, 286), (3, 2), (1, 1)):
        photo = read_photo(path, math.prod(size))
        light = area_average(photo_module.linear_light(whole), photo.size)
        assert np.allclose(linear_from_srgb(photo.pixels), light, atol=2e-5)


@pytest.mark.parametrize(
    ("name", "max_pixels", "reason"),
    [("none.png", 9, "no such file"), (os.fsdecode(b"\xff.png"), 9, "its name is not UTF-8; rename it"),
     ("a.png", 0, "limit of 0 pixels")],
)  # fmt: skip
def test_what_cannot_be_read_is_refused_in_one_line(tmp_path, name, max_pixels, reason):
    if name != "none.png":
        (tmp_path / name).write_bytes(write_oiio(tmp_path / "b.png", RGB).read_bytes())
    with pytest.raises(InputError, match=reason) as caught:
        read_photo(tmp_path / name, max_pixels)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("max_pixels", [2_000_000, 20_000])
def test_a_jpeg_that_is_cut_off_opens_as_far_as_it_goes_but_is_no_view_and_no_map(tmp_path, max_pixels):
    pixels = RNG.integers(0, 256, (300, 200, 3), dtype=np.uint8)
    whole = read_photo(write_oiio(tmp_path / "whole.jpg", pixels), max_pixels)
    content, path = (tmp_path / "whole.jpg").read_bytes(), tmp_path / "cut.jpg"
    path.write_bytes(content[: len(content) // 2])
    photo = read_photo(path, max_pixels)
    assert photo.size == whole.size
    there = photo.size.height * 2 // 5
    assert np.array_equal(photo.pixels[:there], whole.pixels[:there])
    assert np.ptp(photo.pixels[-there:]) == 0, "grey"
    assert "cut off" in photo.notes[0]
    with pytest.raises(InputError, match=r"cut\.jpg: cut off; get the whole file again"):
        read_source(PictureSource(path))
