"""Small pictures: upright, no larger than asked for, and one clear error for what is no photo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.photo import write_image
from iibr_core.formats.images.thumbnail import read_thumbnail
from iibr_core.types import ImageSize, InputError

WITHIN = ImageSize(height=24, width=36)


def halves(height: int, width: int) -> np.ndarray:
    """Red on the left, blue on the right."""
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[:, : width // 2, 0] = pixels[:, width // 2 :, 2] = 200
    return pixels


@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.tif", "a.webp"])
@pytest.mark.parametrize("size", [(48, 80), (90, 30), (1, 1), (1, 400)])
def test_it_fits_and_shows_the_photo(tmp_path: Path, name: str, size: tuple[int, int]) -> None:
    Image.fromarray(halves(*size)).save(tmp_path / name)
    small = read_thumbnail(tmp_path / name, WITHIN)
    assert small.dtype == np.uint8
    assert all(1 <= side <= most for side, most in zip(small.shape[:2], WITHIN))
    if min(size) > 1:
        assert small[small.shape[0] // 2, 1, 0] > 150 > 60 > small[small.shape[0] // 2, -2, 0]


@pytest.mark.parametrize("ending", ["jpg", "png"])
def test_of_two_pictures_side_by_side_the_left_one_is_shown(tmp_path: Path, ending: str) -> None:
    both = np.hstack([halves(40, 64), halves(40, 64)])
    Image.fromarray(both).save(tmp_path / f"a_SBS.{ending}")
    small = read_thumbnail(tmp_path / f"a_SBS.{ending}", WITHIN)
    assert small.shape[:2] == (22, 36)
    assert small[11, 2, 0] > 150 > 60 > small[11, -3, 0]


def test_a_photo_held_sideways_comes_upright(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned clockwise: left goes up
    Image.fromarray(halves(40, 80)).save(tmp_path / "a.jpg", exif=exif)
    small = read_thumbnail(tmp_path / "a.jpg", WITHIN)
    assert small.shape[0] > small.shape[1]
    assert small[2, 5, 0] > 150 > 60 > small[-3, 5, 0]


@pytest.mark.parametrize("contents", [b"", b"\xff\xd8", b"\xff\xd8\xff\xe0" + b"x" * 50, b"no photo", None])
def test_what_is_no_photo_is_refused(tmp_path: Path, contents: bytes | None) -> None:
    if contents is not None:
        (tmp_path / "a.jpg").write_bytes(contents)
    with pytest.raises(InputError, match=r"a\.jpg"):
        read_thumbnail(tmp_path / "a.jpg", WITHIN)


def test_light_of_any_brightness_becomes_bytes(tmp_path: Path) -> None:
    light = np.full((30, 30, 3), 5.0, np.float32)
    light[:15] = np.nan
    write_image(tmp_path / "a.exr", light)
    assert read_thumbnail(tmp_path / "a.exr", WITHIN)[-1, -1].tolist() == [255, 255, 255]
