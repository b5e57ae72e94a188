"""Images as apertures: averaged small, brightest open, and refused where no light would come through."""

import numpy as np
import OpenImageIO as oiio
import pytest

from iibr_core.beyond.aperture_mask import MAX_SIDE, read_mask
from iibr_core.types import InputError


def write(path, pixels, kind="uint8"):
    """Any channels, any type."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(pixels)
    output.close()
    return path


def values_of(path):
    mask = read_mask(path)
    return np.frombuffer(mask.values, np.uint8).reshape(mask.rows, mask.columns)


def test_a_small_grey_image_comes_as_it_is_but_for_its_brightness(tmp_path):
    grey = np.array([[0, 51], [102, 204], [0, 0]], np.uint8)
    path = write(tmp_path / "m.png", grey[..., None])
    np.testing.assert_array_equal(values_of(path), np.round(grey / 204 * 255))
    assert read_mask(path).name == "m.png"


def test_large_images_are_averaged(tmp_path):
    pixels = np.zeros((150, 201, 1), np.uint8)
    pixels[:75] = 200
    pixels[:75, 0] = 250  # a thin line
    values = values_of(write(tmp_path / "m.png", pixels))
    assert values.shape == (MAX_SIDE, MAX_SIDE)
    assert (values[:31, 0] == 255).all()
    assert (values[:31, 1:] == round(255 * 200 / (200 + 50 / 3))).all()
    assert (values[33:] == 0).all()


def test_colour_and_transparency_count_as_grey(tmp_path):
    pixels = np.zeros((1, 3, 4), np.uint8)
    pixels[0] = [[255, 255, 255, 255], [255, 0, 0, 255], [255, 255, 255, 0]]
    np.testing.assert_array_equal(values_of(write(tmp_path / "m.png", pixels)), [[255, 85, 0]])


def test_floats_that_are_no_numbers_let_no_light_through(tmp_path):
    pixels = np.array([[np.nan, np.inf, -1.0, 0.5]], np.float32)[..., None]
    np.testing.assert_array_equal(values_of(write(tmp_path / "m.exr", pixels, "float")), [[0, 0, 0, 255]])


def test_what_cannot_be_an_aperture_is_one_line(tmp_path):
    write(tmp_path / "black.png", np.zeros((8, 8, 1), np.uint8))
    write(tmp_path / "huge.png", np.zeros((4100, 4100, 1), np.uint8))
    (tmp_path / "empty.png").touch()
    (tmp_path / "broken.png").write_bytes((tmp_path / "black.png").read_bytes()[:40])
    for name in ("black.png", "huge.png", "empty.png", "broken.png", "gone.png", "."):
        with pytest.raises(InputError) as error:
            read_mask(tmp_path / name)
        assert "\n" not in str(error.value)
        assert str(tmp_path) in str(error.value)
