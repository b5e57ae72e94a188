"""What a photo's header tells of the memory that decoding takes, in every format."""

import zlib

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.header import HEIC_BYTES, _samples_a_pixel, read_photo_header
from iibr_core.types import InputError

PIXELS = np.random.default_rng(1).integers(0, 255, (60, 80, 3), np.uint8)


@pytest.mark.parametrize(
    ("name", "options", "bytes_a_pixel"),
    [
        ("a.jpg", {}, 0),
        ("a.jpg", {"progressive": True, "subsampling": 0}, 6),
        ("a.jpg", {"progressive": True, "subsampling": 2}, 3),
        ("a.png", {}, 0),
        ("a.tif", {}, 0),
        ("a.bmp", {}, 0),
        ("a.webp", {}, 3),
    ],
)
def test_what_decoders_hold_at_once(tmp_path, name, options, bytes_a_pixel):
    Image.fromarray(PIXELS).save(tmp_path / name, **options)
    header = read_photo_header(tmp_path / name)
    assert header.size == (60, 80)
    assert header.decoding_bytes == bytes_a_pixel * 60 * 80


def test_heic_is_decoded_whole(tmp_path):
    pillow_heif = pytest.importorskip("pillow_heif")
    pillow_heif.from_pillow(Image.fromarray(PIXELS)).save(tmp_path / "a.heic")
    assert read_photo_header(tmp_path / "a.heic") == ((60, 80), 60 * 80 * HEIC_BYTES)


def test_interlaced_png_is_decoded_whole(tmp_path):
    Image.fromarray(PIXELS).save(tmp_path / "a.png")
    data = bytearray((tmp_path / "a.png").read_bytes())
    data[28] = 1
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    (tmp_path / "b.png").write_bytes(data)
    assert read_photo_header(tmp_path / "b.png").decoding_bytes == 60 * 80 * 3


@pytest.mark.parametrize("cut", range(3, 400, 13))
def test_cut_off_headers_are_refused_or_read(tmp_path, cut):
    Image.fromarray(PIXELS).save(tmp_path / "a.jpg", progressive=True)
    path = tmp_path / "b.jpg"
    path.write_bytes((tmp_path / "a.jpg").read_bytes()[:cut])
    size = (60, 80)
    try:
        size = read_photo_header(path).size
    except InputError as error:
        size = (60, 80) if str(path) in str(error) else str(error)
    assert size == (60, 80)


@pytest.mark.parametrize("frame", [b"", b"\x08\0\x10\0\x10\x01\x01\x11", b"\x08\0\x10\0\x10\x01\x01\x10\0"])
def test_a_frame_that_says_nothing_of_use_is_taken_for_four_full_components(frame):
    """Cut off, or sampled not at all."""
    assert _samples_a_pixel(frame) == 4
