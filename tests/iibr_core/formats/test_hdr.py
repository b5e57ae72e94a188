import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from iibr_core.color import linear_from_srgb
from iibr_core.formats.images.color_profile import codes_named
from iibr_core.formats.images.hdr import KNEE, hlg_display_light, hlg_scene_light, pq_light
from iibr_core.formats.images.photo import read_photo
from tests.iibr_core.pictures import write_oiio

PQ, HLG = (9, 16, 0, 1), (9, 18, 0, 1)
BT2020_FROM_SRGB = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])


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


def test_curves_have_the_values_of_the_standards() -> None:
    """BT.2100, BT.2408: 58 % of PQ and 75 % of HLG are 203 cd/m2, reference white."""
    assert pq_light(np.array([0.0, 0.5807, 1.0])) == pytest.approx([0, 1, 10000 / 203], rel=2e-3)
    grey = np.full((1, 1, 3), hlg_scene_light(np.array(0.75)), np.float32)
    assert hlg_display_light(grey) == pytest.approx(1, rel=5e-3)
    white = np.full((1, 1, 3), hlg_scene_light(np.array(1.0)), np.float32)
    assert hlg_display_light(white) == pytest.approx(1000 / 203, rel=1e-3)
