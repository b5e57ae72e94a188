"""Photos with a map of a drawn scene inside, as each camera and program writes it, are opened and compared with it."""

from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest
from PIL import Image, ImageFilter

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.write import write_image_file
from iibr_core.types import GridShape
from tests.iibr_core import embedded_files as files
from tests.iibr_core.depth.drawn_photo import (
    LOSSY,
    as_bytes,
    assert_as_kept,
    assert_disparity,
    assert_metres,
    drawn,
    stored_as,
    unit,
    usual_disparity,
)
from tests.iibr_core.formats.test_view_files import leia_image, lume_pad_2
from tests.iibr_core.pictures import with_xmp

UNREFINED = DepthChoice(refine=False)


class Stored:
    """The scene as a camera stores it: turned against the orientation that Exif states; the map of half the size."""

    def __init__(self, orientation: int = 1, has_sky: bool = False) -> None:
        self.orientation = orientation
        pixels, near = drawn(has_sky)
        self.pixels, self.near = (stored_as(image, orientation) for image in (pixels, near[::2, ::2]))
        self.far, self.close = 1 / max(near.min(), 1e-3), 1 / near.max()

    @cached_property
    def photo(self) -> bytes:
        return files.picture(self.pixels, orientation=self.orientation)

    @cached_property
    def blurred(self) -> bytes:
        soft = Image.fromarray(self.pixels).filter(ImageFilter.GaussianBlur(3))
        return files.picture(np.asarray(soft), orientation=self.orientation)

    @property
    def white(self) -> np.ndarray:
        """The map's bytes, white near."""
        return as_bytes(unit(self.near))

    @property
    def black(self) -> np.ndarray:
        return as_bytes(1 - unit(self.near))

    @property
    def distances(self) -> np.ndarray:
        """Shares of the way from the nearest to the farthest distance."""
        return unit(1 / np.maximum(self.near, 1e-3))


def png(pixels: np.ndarray) -> bytes:
    return files.picture(pixels, "PNG")


def gdepth(s: Stored, stored: np.ndarray | None = None, photo: bytes | None = None, **options: Any) -> bytes:
    stored = s.black if stored is None else stored
    options = {"near": s.close, "far": s.far} | options
    return files.with_segments(photo or s.photo, files.gdepth_segments(png(stored), **options))


def confidence(s: Stored) -> bytes:
    """Nothing is sure in a corner of the box."""
    sure = np.full(drawn()[1].shape, 90, np.uint8)[::2, ::2]
    sure[50:60, 70:80] = 3
    return png(stored_as(sure, s.orientation))


def points(stored: np.ndarray) -> bytes:
    sure = np.zeros_like(stored)
    sure[::5, ::5] = 255
    return png(sure)


def in_packet(s: Stored, kind: str) -> bytes:
    packet = files.gdepth_segments(png(s.black), near=s.close, far=s.far)[0].removeprefix(files.STANDARD)
    return with_xmp(Image.fromarray(s.pixels), kind, packet)


def lytro(s: Stored, is_illum: bool) -> bytes:
    """The disc is sharp in one picture, all else in another."""
    is_disc = drawn()[1] > 0.9
    parts = [np.where((is_disc == shown)[..., None], s.pixels, 200).astype(np.uint8) for shown in (False, True)]
    pictures = {6.0: png(parts[0]), -4.0: png(parts[1])}
    return files.lytro_stack(pictures, 6 - 10 * unit(drawn()[1]), s.pixels.shape[:2], is_illum)


def half_sided(s: Stored, axis: int, is_map_first: bool) -> bytes:
    grey = np.repeat(as_bytes(0.05 + 0.95 * unit(drawn()[1]))[..., None], 3, 2)
    return files.picture(np.concatenate([grey, s.pixels] if is_map_first else [s.pixels, grey], axis))


def with_list_of_pictures(photo: bytes) -> bytes:
    return photo[:2] + b"\xff\xe2\0\x0aMPF\0\0\0\0\0" + photo[2:] + photo


NOTHING: Mapping[str, Any] = MappingProxyType({})


class Row(NamedTuple):
    """name: of the file. make: its bytes. orientation: of photo and map. metres: 1 / m by the scene's, if it has any.

    options: of `open_with_depth`. atol: in px.
    """

    name: str
    make: Callable[[Stored], bytes]
    orientation: int = 1
    metres: Callable[[np.ndarray], np.ndarray] | None = None
    options: Mapping[str, Any] = NOTHING
    atol: float = LOSSY
    has_sky: bool = False


def guessed(make: Callable[[Stored], bytes], name: str = "a.jpg") -> Row:
    return Row(name, make, atol=np.inf)


def same(near: np.ndarray) -> np.ndarray:
    return near


def of_dynamic_depth(near: np.ndarray) -> np.ndarray:
    """From 2 to 10 metres."""
    return 0.1 + 0.4 * unit(near)


INVERTED = {"choice": DepthChoice(inverts=True, refine=False)}
STEREO = {"inv_z_map": {"blob_id": 11}}
ROWS = {
    "gdepth, metres": Row("a.jpg", lambda s: gdepth(s, units="m"), 6, same),
    "gdepth, inverted metres": Row("a.jpg", lambda s: gdepth(s, units="m"), 5, options=INVERTED),
    "gdepth, linear 16 bits in mm, in parts, seen by 3 rows": Row(
        "a.jpg",
        lambda s: gdepth(
            s, np.rint(65535 * s.distances).astype(np.uint16), kind="RangeLinear", near=1000 * s.close,
            far=1000 * s.far, units="mm", part_bytes=3000,
        ),
        3, same, {"grid": GridShape(3, 1)}, 0.1,
    ),
    "gdepth, furlongs": Row("a.jpg", lambda s: gdepth(s, units="furlongs"), 7),
    "gdepth to infinity": Row("a.jpg", lambda s: gdepth(s, far="Infinity"), 8, options=INVERTED),
    "gdepth to infinity in metres, sky": Row(
        "a.jpg", lambda s: gdepth(s, far="inf", units="Meters"), 2, same, has_sky=True
    ),
    "gdepth, turned already": Row("a.jpg", lambda s: gdepth(s, Stored().black), 8),
    "gdepth, squashed": Row(
        "a.jpg", lambda s: gdepth(s, np.asarray(Image.fromarray(s.black).resize((100, 90)))), 4, atol=0.06
    ),
    "gdepth, unsure": Row("a.jpg", lambda s: gdepth(s, confidence=confidence(s)), 6),
    "gdepth, hardly sure": Row("a.jpg", lambda s: gdepth(s, confidence=points(s.black)), 6, atol=np.inf),
    "gdepth, sure of nothing": Row("a.jpg", lambda s: gdepth(s, confidence=png(0 * s.black)), 1),
    "gdepth, no format": Row("a.jpg", lambda s: gdepth(s, kind="", near=5, far=3), 1),
    "gdepth, from 0": Row("a.jpg", lambda s: gdepth(s, near=0, far=0, units="m"), 1),
    "gdepth, linear to infinity": Row("a.jpg", lambda s: gdepth(s, kind="RangeLinear", near=1, far="inf"), 1),
    "gdepth, no range": Row("a.jpg", lambda s: gdepth(s, near="", far=""), 1),
    "gdepth, png": Row("a.png", lambda s: in_packet(s, "PNG")),
    "gdepth, webp": Row("a.webp", lambda s: in_packet(s, "WEBP")),
    "gdepth, avif": Row("a.avif", lambda s: in_packet(s, "AVIF")),
    "gdepth with a sharp picture, small": Row(
        "a.jpg",
        lambda s: gdepth(s, photo=s.blurred, sharp=png(s.pixels), part_bytes=50_000),
        6, options={"max_pixels": 80 * 120},
    ),
    "gdepth before a sharp picture": Row("a.jpg", lambda s: gdepth(s, photo=s.blurred) + s.photo, 6),
    "dynamic depth": Row(
        "a.jpg", lambda s: files.dynamic_depth_jpeg(s.photo, png(s.black), between=b"other"), 6, of_dynamic_depth
    ),
    "dynamic depth after a gain map, before a trailer": Row(
        "a.jpg",
        lambda s: files.dynamic_depth_jpeg(s.photo, png(s.black), before=files.grey_photo((3, 4)), behind=b"."),
        8, of_dynamic_depth,
    ),
    "dynamic depth with a sharp picture": Row(
        "a.jpg",
        lambda s: files.dynamic_depth_jpeg(s.blurred, png(s.black), original=files.picture(s.pixels)),
        3, of_dynamic_depth,
    ),
    "pixel": Row(
        "a.jpg",
        lambda s: files.dynamic_depth_jpeg(
            s.blurred, png(s.black), before=png(s.white), original=s.photo, shared_container=True
        ),
        6, of_dynamic_depth,
    ),
    "apple jpeg": Row("a.jpg", lambda s: files.apple_jpeg(s.photo + b"padding", s.white, 0.5, 2.5), 6),
    "apple jpeg, distances": Row(
        "a.jpg",
        lambda s: files.apple_jpeg(s.photo, as_bytes(s.distances), s.close, s.far, "depth"),
        atol=0.2,
    ),
    "apple heic": Row("a.heic", lambda s: files.heic(s.pixels, s.white)),
    "samsung": Row("a.jpg", lambda s: files.samsung_jpeg(s.photo, s.black, audio=True), 6),
    "samsung with a sharp picture": Row("a.jpg", lambda s: files.samsung_jpeg(s.blurred, s.black, sharp=s.photo), 8),
    "samsung heic, turned": Row(
        "a.heic", lambda s: files.samsung_jpeg(files.heic(s.pixels, orientation=s.orientation), s.black), 6
    ),
    "huawei, first phones": Row("a.jpg", lambda s: files.huawei_jpeg(s.photo, s.white[:, ::-1])),
    "huawei, black near": Row("a.jpg", lambda s: files.huawei_jpeg(s.photo, s.black[::-1], 0x10)),
    "huawei, black near, inverted": Row(
        "a.jpg", lambda s: files.huawei_jpeg(s.photo, s.black[:, ::-1], 0x12), options=INVERTED
    ),
    "huawei, held left": Row("a.jpg", lambda s: files.huawei_jpeg(s.photo, s.white.T, 0x13)),
    "huawei, held right, sharp": Row(
        "a.jpg", lambda s: files.huawei_jpeg(s.blurred, s.white.T[::-1, ::-1], 0x11, s.photo)
    ),
    "xiaomi": Row("a.jpg", lambda s: s.blurred + s.photo + files.picture(s.white)),
    "a second picture, no sharp one": Row("a.jpg", lambda s: s.photo + s.blurred + files.picture(s.white), 6),
    "avif": Row("a.avif", lambda s: files.avif(s.pixels, stored_as(as_bytes(unit(drawn()[1])), 6), 6), 6),
    "avif, black near": Row("a.avif", lambda s: files.avif(s.pixels, as_bytes(1 - unit(drawn()[1])))),
    "leia": Row("a.lif", lambda s: leia_image(s.pixels, s.pixels, (11, files.picture(s.white)), **STEREO)),
    "lume pad 2": Row("a.jpg", lambda s: lume_pad_2(s.pixels, s.pixels, (1000002, files.picture(s.white)))),
    "lytro illum": Row("IMG_0001-stk.lfp", lambda s: lytro(s, True)),
    "lytro": Row("a.jpg", lambda s: lytro(s, False), options=INVERTED),
    "beside": Row("photo_rgbd.jpg", lambda s: half_sided(s, 1, False)),
    "beside, unnamed": Row("IMG_1.png", lambda s: half_sided(s, 1, False), options=INVERTED),
    "map on the left": Row("left_RGBD.png", lambda s: half_sided(s, 1, True)),
    "map below": Row("below_rgbd.jpg", lambda s: half_sided(s, 0, False)),
    "not read: matte of a heic": guessed(
        lambda s: files.heic(s.pixels, s.white, b"urn:com:apple:photo:2018:aux:portraiteffectsmatte"), "a.heic"
    ),
    "not read: matte": guessed(
        lambda s: files.apple_jpeg(s.photo, s.white, 0, 1, "urn:com:apple:photo:2019:aux:semanticskinmatte")
    ),
    "not read: a copy": guessed(lambda s: s.photo + s.photo),
    "not read: a mask": guessed(lambda s: s.photo + files.picture(np.where(s.near > 0.6, 255, 0).astype(np.uint8))),
    "not read: another shape": guessed(lambda s: s.photo + files.picture(s.white[:, :60])),
    "not read: xiaomi": guessed(lambda s: s.photo + b"PMPD\x02\0\x64\0\x01\0" + bytes(100)),
    "no word: gain map": guessed(
        lambda s: s.photo + files.with_segments(files.picture(s.white), [files.STANDARD + b"<x hdrgm:Version='1.0'/>"])
    ),
    "no word: listed preview": guessed(lambda s: with_list_of_pictures(s.photo)),
    "no word: other trailer": guessed(lambda s: s.photo + b"some other trailer"),
    "no word: nothing": guessed(lambda s: s.photo),
}  # fmt: skip


@pytest.mark.parametrize("name", ROWS)
def test_a_map_inside_is_found_turned_scaled_and_named(tmp_path, regenerate_golden, name) -> None:
    row = ROWS[name]
    (tmp_path / row.name).write_bytes(row.make(Stored(row.orientation, row.has_sky)))
    found = open_with_depth(tmp_path / row.name, **({"choice": UNREFINED} | row.options))
    pixels, near = drawn(row.has_sky)
    step = len(pixels) // found.photo.size.height
    sharp = found.photo.pixels[20:28, 20:28] * 255 - pixels[20:28, 20:28]
    assert step > 1 or np.abs(sharp).mean() < 4, "the sharp picture"
    near, grid = near[::step, ::step], row.options.get("grid", GridShape(9, 9))
    if row.options.get("choice", UNREFINED).inverts:
        near = 1 / near if "metres" in name else -near
    assert_disparity(found, usual_disparity(near, grid), row.atol)
    if row.metres is not None:
        assert_metres(found, row.metres(near))
    assert_as_kept(found, tmp_path, "embedded", name, regenerate_golden)


@pytest.mark.parametrize("prefixes", [("", ""), ("ViewLayer.Combined.", "ViewLayer.Depth.")])
def test_the_depth_channel_of_a_rendered_picture(tmp_path, regenerate_golden, prefixes) -> None:
    photo, near = drawn(has_sky=True)
    names = (*(prefixes[0] + name for name in "RGBA"), prefixes[1] + "Z")
    depth = np.where(near > 0, 1 / np.maximum(near, 0.05), 1e10)
    pixels = np.dstack([photo.astype(np.float32) / 255, np.ones_like(near), depth]).astype(np.float32)
    write_image_file(tmp_path / "render.exr", pixels, "float", channels=names)
    found = open_with_depth(tmp_path / "render.exr", UNREFINED)
    assert_disparity(found, usual_disparity(near))
    assert_metres(found, near)
    assert_as_kept(found, tmp_path, "embedded", "depth channel", regenerate_golden)
