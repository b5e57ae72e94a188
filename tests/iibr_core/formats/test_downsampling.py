"""A photo made smaller while it is read: the same as from all its rows at once, to the bit, however few are there."""

import itertools

import numpy as np
import OpenImageIO as oiio
import pytest

from iibr_core.formats.images import downsampling, oiio_reader
from iibr_core.formats.images.downsampling import downsampled_linear
from iibr_core.formats.images.oiio_reader import PictureRows, read_raster
from iibr_core.formats.images.photo import read_photo
from iibr_core.runtime.tiling import Cancelled
from iibr_core.types import ImageSize, InputError

KINDS = {
    "strips.png": {"dtype": "uint8"},
    "deep.png": {"dtype": "uint16"},
    "strips.tif": {"dtype": "uint8", "tiff:RowsPerStrip": 7},
    "tiles.tif": {"dtype": "uint16", "tile": 64},
    "strips.exr": {"dtype": "half"},
    "tiles.exr": {"dtype": "float", "tile": 32},
    "lines.jpg": {"dtype": "uint8"},
    "alpha.png": {"dtype": "uint8", "channels": 4},
    "alpha.tif": {"dtype": "uint8", "channels": 4, "tile": 64},
}


def stored_file(path, shape=(333, 287), dtype="uint8", channels=3, tile=0, values=None, **attributes):
    spec = oiio.ImageSpec(shape[1], shape[0], channels, dtype)
    spec.tile_width = spec.tile_height = tile
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    if values is None:
        values = np.random.default_rng(4).random((*shape, channels), np.float32)
    assert output.write_image(values), output.geterror()
    output.close()
    return path


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("size", [(100, 86), (33, 28), (332, 286), (1, 1), (3, 200)])
def test_few_rows_at_a_time_give_what_all_give_at_once(tmp_path, monkeypatch, name, size):
    path = stored_file(tmp_path / name, **KINDS[name])
    whole, is_opaque, _ = downsampled_linear(lambda: read_raster(path), ImageSize(*size))
    monkeypatch.setattr(oiio_reader, "ROWS_AT_ONCE", 5)
    monkeypatch.setattr(downsampling, "MOST_ROWS_PIXELS", 1000)
    by_rows, is_opaque_by_rows, _ = downsampled_linear(lambda: PictureRows(path), ImageSize(*size))
    assert np.array_equal(by_rows, whole)
    assert is_opaque_by_rows == is_opaque


def test_rows_are_those_of_the_whole(tmp_path):
    path = stored_file(tmp_path / "a.tif", tile=64)
    whole, rows = read_raster(path).pixels, PictureRows(path)
    for first, last in ((0, 3), (2, 90), (80, 81), (80, 200), (200, 333)):
        assert np.array_equal(rows.read(first, last).pixels, whole[first:last])


def test_infinity_becomes_the_largest_value_even_of_later_rows(tmp_path):
    values = np.full((200, 50, 3), 0.5, np.float32)
    values[3, 4], values[5, 6, 1], values[190, 7] = np.inf, np.nan, 7.0
    photo = read_photo(stored_file(tmp_path / "a.exr", values.shape[:2], "float", values=values), 2500)
    clean = np.where(np.isinf(values), 7.0, np.nan_to_num(values, posinf=7.0)).astype(np.float32)
    expected = read_photo(stored_file(tmp_path / "b.exr", values.shape[:2], "float", values=clean), 2500)
    assert np.array_equal(photo.pixels, expected.pixels)
    assert photo.notes[-1].startswith("2 pixels held NaN or infinity")
    assert "(7)" in photo.notes[-1]


def test_a_damaged_end_is_told_while_rows_are_read(tmp_path):
    path = stored_file(tmp_path / "a.tif", tile=64)
    path.write_bytes(path.read_bytes()[:-60_000])
    with pytest.raises(InputError, match=r"a\.tif"):
        read_photo(path, 1000)


def test_a_file_that_nobody_wants_any_more_is_not_read_to_its_end(tmp_path, monkeypatch):
    path = stored_file(tmp_path / "a.jpg")
    monkeypatch.setattr(downsampling, "MOST_ROWS_PIXELS", 1000)
    asked = itertools.count()
    with pytest.raises(Cancelled):
        read_photo(path, 1000, should_stop=lambda: next(asked) == 3)
    assert next(asked) == 4
