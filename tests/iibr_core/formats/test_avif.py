"""AVIF photos: colours, alpha, orientation, profiles, headers, and damaged ones."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.avif import is_avif, read_avif
from iibr_core.formats.images.header import read_photo_header
from iibr_core.formats.images.photo import read_photo
from iibr_core.types import InputError
from tests.iibr_core.formats.test_color_profile import profile_bytes

EXACT = {"quality": 100, "subsampling": "4:4:4"}
ACROSS = np.zeros((48, 64, 3), np.uint8)
ACROSS[:, :32] = (220, 30, 40)


def save(path, pixels, **options):
    Image.fromarray(pixels).save(path, **EXACT, **options)
    return path


def test_colours_and_size(tmp_path):
    photo = read_photo(save(tmp_path / "a.avif", ACROSS))
    assert np.abs(255 * photo.pixels - ACROSS).max() < 4
    assert (photo.notes, photo.is_hdr) == ((), False)
    assert read_photo_header(tmp_path / "a.avif").size == (48, 64)
    assert read_photo(tmp_path / "a.avif", max_pixels=200).size == (12, 16)


def test_by_what_is_in_it(tmp_path):
    (tmp_path / "a.jpg").write_bytes(save(tmp_path / "a.avif", ACROSS).read_bytes())
    assert is_avif(tmp_path / "a.jpg")
    assert read_photo(tmp_path / "a.jpg").size == (48, 64)
    Image.fromarray(ACROSS).save(tmp_path / "b.avif", format="PNG")
    assert not is_avif(tmp_path / "b.avif")


def test_grey(tmp_path):
    photo = read_photo(save(tmp_path / "a.avif", ACROSS[..., 0]))
    assert np.abs(255 * photo.pixels - ACROSS[..., :1]).max() < 4


def test_alpha_is_laid_over_black(tmp_path):
    pixels = np.dstack([np.full((48, 64, 3), 255, np.uint8), ACROSS[..., 0]])
    photo = read_photo(save(tmp_path / "a.avif", pixels))
    assert photo.notes == ("Transparency was dropped: the photo is laid over black.",)
    assert photo.pixels[:, 40:].max() < 0.02
    opaque = np.dstack([ACROSS, np.full((48, 64), 255, np.uint8)])
    assert read_avif(save(tmp_path / "b.avif", opaque)).alpha is None


def test_turned_upright(tmp_path):
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was held upright: turn right
    photo = read_photo(save(tmp_path / "a.avif", ACROSS, exif=exif.tobytes()))
    assert photo.size == (64, 48)
    assert photo.pixels[10, 24, 0] > 0.7, "left is up now"
    assert photo.pixels[50, 24, 0] < 0.1


def test_focal_length_and_profile(tmp_path):
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 50
    patch = np.full((48, 64, 3), (200, 80, 60), np.uint8)
    photo = read_photo(save(tmp_path / "a.avif", patch, exif=exif.tobytes(), icc_profile=profile_bytes()))
    assert photo.focal_px == pytest.approx(50 / np.hypot(36, 24) * 80)
    assert np.abs(255 * photo.pixels - (216, 69, 50)).max() < 3
    assert photo.notes[0] == "Colours are those of the photo's profile, 'made here'."


@pytest.mark.parametrize("share", [0.0, 0.02, 0.1, 0.5, 0.9])
def test_cut_off(tmp_path, share):
    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3), np.uint8)
    data = save(tmp_path / "whole.avif", noise).read_bytes()
    (tmp_path / "a.avif").write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=r"a\.avif: "):
        read_photo(tmp_path / "a.avif")


@pytest.mark.parametrize("seed", range(40))
def test_flipped_bytes_are_read_or_refused(tmp_path, seed):
    rng = np.random.default_rng(seed)
    whole = save(tmp_path / "whole.avif", ACROSS, icc_profile=profile_bytes())
    data = np.frombuffer(whole.read_bytes(), np.uint8).copy()
    data[rng.integers(4 * (seed % 4), min(len(data), 400 + 100 * seed), 6)] = rng.integers(0, 256, 6)
    (tmp_path / "a.avif").write_bytes(data.tobytes())
    try:
        photo = read_photo(tmp_path / "a.avif")
    except InputError:
        return
    assert np.isfinite(photo.pixels).all()
