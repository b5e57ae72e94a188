import struct
import zlib
from pathlib import Path

import numpy as np
import pillow_heif
import pytest
from numpy.typing import NDArray
from PIL import Image

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.formats.images.color_profile import codes_named, read_profile
from iibr_core.formats.images.hdr import KNEE, hlg_display_light, hlg_scene_light, pq_light
from iibr_core.formats.images.photo import read_photo, read_thumbnail
from iibr_core.types import ImageSize
from tests.iibr_core.formats.test_color_profile import profile_bytes
from tests.iibr_core.pictures import write_oiio

PQ, HLG = (9, 16, 0, 1), (9, 18, 0, 1)
BT2020_FROM_SRGB = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])


def scene(height: int = 48, width: int = 64) -> NDArray[np.uint8]:
    """Smooth colours below white, which lossy formats keep."""
    y, x = np.mgrid[0:height, 0:width]
    return np.stack([110 + x, 170 - y, 130 + 40 * np.sin(x / 15)], axis=-1).astype(np.uint8)


def encoded(linear: NDArray[np.float64], codes: tuple[int, ...]) -> NDArray[np.uint16]:
    """Light of sRGB, 1 = white, as PQ or HLG of BT.2020, by their inverse: a table of what each value means."""
    values = np.linspace(0, 1, 65536)
    light = linear @ BT2020_FROM_SRGB.T
    if codes == HLG:
        # The other way round of the display: light in front of the camera, of its luminance.
        luminance = np.maximum(light @ (0.2627, 0.6780, 0.0593), 1e-9) * 203 / 1000
        light = light * (203 / 1000) * (luminance ** (1 / 1.2 - 1))[..., None]
    table = hlg_scene_light(values) if codes == HLG else pq_light(values)
    return np.interp(light, table, values * 65535).round().astype(np.uint16)


def chunked(png: bytes, kind: bytes, content: bytes) -> bytes:
    chunk = struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    return png[:33] + chunk + png[33:]


def write_png(path: Path, pixels: NDArray[np.uint16], codes: tuple[int, ...]) -> None:
    write_oiio(path, pixels, oiio__UnassociatedAlpha=1)
    path.write_bytes(chunked(path.read_bytes(), b"cICP", bytes(codes)))


def write_heic(path: Path, pixels: NDArray[np.uint16], codes: tuple[int, ...]) -> None:
    size = pixels.shape[1::-1]
    file = pillow_heif.from_bytes(mode="RGB;16", size=size, data=np.ascontiguousarray(pixels).tobytes())
    numbers = {"color_primaries": codes[0], "transfer_characteristics": codes[1], "matrix_coefficients": 9}
    file.save(path, quality=100, chroma=444, full_range_flag=1, **numbers)


def write_avif(path: Path, pixels: NDArray[np.uint16], codes: tuple[int, ...]) -> None:
    """Pillow writes 8 bits, and sRGB's numbers, which are changed here."""
    Image.fromarray((pixels / 257).round().astype(np.uint8)).save(path, quality=100, subsampling="4:4:4")
    data = path.read_bytes()
    assert data.count(b"nclx\0\x01\0\x0d") == 1
    path.write_bytes(data.replace(b"nclx\0\x01\0\x0d", b"nclx" + struct.pack(">HH", *codes[:2])))


def write_jxl(path: Path, pixels: NDArray[np.uint16], codes: tuple[int, ...]) -> None:
    write_oiio(path, pixels, "float" if path.stem == "float" else "uint16", CICP=codes)


WRITERS = {
    "a.png": (write_png, 0.05),
    "a.heic": (write_heic, 0.8),
    "a.avif": (write_avif, 3.5),
    "a.jxl": (write_jxl, 0.05),
    "float.jxl": (write_jxl, 0.05),
}
"""Writer of each kind, and the mean difference that it causes, of 255."""


@pytest.mark.parametrize("codes", [PQ, HLG], ids=["PQ", "HLG"])
@pytest.mark.parametrize("name", WRITERS)
def test_light_up_to_white_comes_back_with_a_note(tmp_path, name, codes) -> None:
    write, tolerance = WRITERS[name]
    write(tmp_path / name, encoded(linear_from_srgb(scene() / 255), codes), codes)
    photo = read_photo(tmp_path / name)
    assert np.abs(255 * photo.pixels - scene()).mean() < tolerance
    assert not photo.is_hdr
    curve = "PQ" if codes == PQ else "HLG"
    assert photo.notes == (f"HDR photo ({curve}): its highlights are compressed to the range of ordinary photos.",)
    kept = read_photo(tmp_path / name, keeps_primaries=True)
    assert kept.color_space.name == "BT.2020"
    smaller = read_photo(tmp_path / name, max_pixels=48 * 64 // 4)
    halved = linear_from_srgb(scene() / 255).reshape(24, 2, 32, 2, 3).mean(axis=(1, 3))
    assert np.abs(255 * (smaller.pixels - srgb_from_linear(halved))).mean() < tolerance
    thumbnail = read_thumbnail(tmp_path / name, ImageSize(24, 32))
    assert np.abs(thumbnail - 255 * srgb_from_linear(halved)).mean() < tolerance + 0.5


@pytest.mark.parametrize("codes", [PQ, HLG], ids=["PQ", "HLG"])
def test_highlights_are_compressed_and_keep_their_order_and_hue(tmp_path, codes) -> None:
    ramp = np.linspace(0.02, 4, 64)
    light = np.stack([np.tile(ramp, (8, 1))] * 3, axis=-1)
    light[4:] *= (1.0, 0.5, 0.25)
    write_png(tmp_path / "a.png", encoded(light, codes), codes)
    photo = read_photo(tmp_path / "a.png")
    found = linear_from_srgb(photo.pixels)
    is_low = light[0, :, 0] < KNEE
    assert np.abs(found[:, is_low] - light[:, is_low]).max() < 2e-3
    assert (np.diff(found[0, :, 0]) > 0).all()
    assert found.max() == pytest.approx(1, abs=1e-3)
    assert not photo.is_hdr
    kept = linear_from_srgb(read_photo(tmp_path / "a.png", keeps_primaries=True).pixels)
    np.testing.assert_allclose(kept[5, :, 1] / kept[5, :, 0], kept[5, 0, 1] / kept[5, 0, 0], rtol=0.01)


@pytest.mark.parametrize(
    ("name", "codes"),
    [("ITUR_2100_PQ_FULL", (9, 16)), ("Rec. ITU-R BT.2100 HLG", (9, 18)), ("Display P3 PQ", (12, 16)),
     ("HP PQ27 monitor", ()), ("sRGB IEC61966-2.1", ())],
)  # fmt: skip
def test_profiles_of_hdr_are_known_by_their_names(name, codes) -> None:
    assert codes_named(name) == codes


@pytest.mark.parametrize("kind", ["jpg", "tif"])
def test_numbers_in_a_profile_state_pq(tmp_path, kind) -> None:
    """Profiles of version 4.4 have such a tag: ICC.1:2022, clause 9.2.17."""
    profile = bytearray(profile_bytes())
    count = int.from_bytes(profile[128:132], "big")
    at = 132 + 12 * (count - 1)
    profile[at : at + 12] = struct.pack(">4sII", b"cicp", len(profile), 12)
    profile += b"cicp\0\0\0\0" + bytes(PQ)
    profile[:4] = len(profile).to_bytes(4, "big")
    meaning, _ = read_profile(bytes(profile))
    assert meaning.hdr == "PQ"
    pixels = (encoded(linear_from_srgb(scene() / 255), PQ) / 257).round().astype(np.uint8)
    options = {"quality": 100, "subsampling": 0} if kind == "jpg" else {}
    Image.fromarray(pixels).save(tmp_path / f"a.{kind}", icc_profile=bytes(profile), **options)
    photo = read_photo(tmp_path / f"a.{kind}")
    assert np.abs(255 * photo.pixels - scene()).mean() < (3 if kind == "jpg" else 1.5)
    assert photo.notes[0].startswith("HDR photo (PQ)")


def test_curves_have_the_values_of_the_standards() -> None:
    """BT.2100, BT.2408: 58 % of PQ and 75 % of HLG are 203 cd/m2, reference white."""
    assert pq_light(np.array([0.0, 0.5807, 1.0])) == pytest.approx([0, 1, 10000 / 203], rel=2e-3)
    grey = np.full((1, 1, 3), hlg_scene_light(np.array(0.75)), np.float32)
    assert hlg_display_light(grey) == pytest.approx(1, rel=5e-3)
    white = np.full((1, 1, 3), hlg_scene_light(np.array(1.0)), np.float32)
    assert hlg_display_light(white) == pytest.approx(1000 / 203, rel=1e-3)


@pytest.mark.parametrize(
    ("codes", "name"), [((9, 1), "BT.2020"), ((1, 4), "sRGB"), ((11, 13), "DCI-P3"), ((5, 6), "BT.601 (625 lines)")]
)
def test_other_numbers_are_colours_of_their_spaces(tmp_path, codes, name) -> None:
    flat = np.full((8, 8, 3), (180 * 257, 90 * 257, 40 * 257), np.uint16)
    write_png(tmp_path / "a.png", flat, (*codes, 0, 1))
    photo = read_photo(tmp_path / "a.png", keeps_primaries=True)
    assert photo.color_space.name == name
    assert photo.notes == (f"Colours are those of the photo's profile, '{name}'.",)
