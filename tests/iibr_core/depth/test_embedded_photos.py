import base64
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageFilter

from iibr_core.depth.embedded.embedded import embedded_in_jpeg, unread_parts
from iibr_core.depth.search import PhotoWithDepth, open_with_depth
from iibr_core.formats.images.jpeg_xl import has_depth_channel
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.side_by_side import photo_size
from iibr_core.types import InputError
from tests.iibr_core import embedded_files as files
from tests.iibr_core.pictures import with_xmp

PIXELS, DEPTH = files.disc_scene()
PHOTO = files.picture(PIXELS)
SMALL = DEPTH[::2, ::2]
MAP = files.picture(255 - SMALL, "PNG")


def opened(tmp_path: Path, name: str, data: bytes) -> PhotoWithDepth:
    (tmp_path / name).write_bytes(data)
    return open_with_depth(tmp_path / name)


def assert_disc_is_nearest(found: PhotoWithDepth) -> None:
    assert found.origin.kind == "embedded"
    assert found.disparity.values[60, 60] > found.disparity.values[90, 10] > found.disparity.values[4, 10]
    assert found.disparity.values[60, 33] > found.disparity.values[60, 94], "not mirrored"


# ---- Google


@pytest.mark.parametrize(
    ("kind", "near", "far"),
    [("", 5, 3), ("RangeInverse", 0, 0), ("RangeInverse", -1, 3), ("RangeInverse", "nan", "inf"),
     ("RangeLinear", 1, "inf"), ("RangeInverse", "", "")],
)  # fmt: skip
def test_a_senseless_range_is_told_and_dark_is_near(tmp_path, kind, near, far) -> None:
    segments = files.gdepth_segments(files.picture(255 - SMALL, "PNG"), kind=kind, near=near, far=far)
    found = opened(tmp_path, "a.jpg", files.with_segments(PHOTO, segments))
    assert_disc_is_nearest(found)
    assert any("makes no sense: only the order" in note for note in found.disparity.notes) is (near != "")


@pytest.mark.parametrize("kind", ["PNG", "WEBP", "AVIF"])
def test_gdepth_in_other_kinds_of_files(tmp_path, kind) -> None:
    xmp = files.gdepth_segments(files.picture(255 - SMALL, "PNG"))[0].removeprefix(files.STANDARD)
    assert_disc_is_nearest(opened(tmp_path, f"a.{kind.lower()}", with_xmp(Image.fromarray(PIXELS), kind, xmp)))


# ---- phones' trailers


@pytest.mark.parametrize("white_is_near", [True, False])
@pytest.mark.parametrize(
    ("orientation", "stored"),
    [(0, SMALL[:, ::-1]), (0x10, SMALL[::-1]), (0x12, SMALL[:, ::-1]), (0x13, SMALL.T), (0x11, SMALL.T[::-1, ::-1])],
)
def test_huawei_maps_lie_as_the_phone_was_held(tmp_path, orientation, stored, white_is_near) -> None:
    stored = stored if white_is_near else 255 - stored
    found = opened(tmp_path, "a.jpg", files.huawei_jpeg(PHOTO, stored, orientation))
    assert_disc_is_nearest(found)
    assert found.origin.near == ("white" if white_is_near else "black")
    assert any("counts as near" in note for note in found.disparity.notes)


def blurred_and_sharp() -> tuple[bytes, bytes]:
    blurred = np.asarray(Image.fromarray(PIXELS).filter(ImageFilter.GaussianBlur(3)))
    return files.picture(blurred), files.picture(PIXELS)


WITH_SHARP_PICTURE = {
    "Dynamic Depth": lambda photo, sharp: files.dynamic_depth_jpeg(photo, MAP, original=sharp),
    "Pixel": lambda photo, sharp: files.dynamic_depth_jpeg(
        photo, MAP, before=MAP, original=sharp, shared_container=True
    ),
    "Samsung": lambda photo, sharp: files.samsung_jpeg(photo, 255 - SMALL, sharp=sharp),
    "Huawei": lambda photo, sharp: files.huawei_jpeg(photo, SMALL[:, ::-1], sharp=sharp),
    "Xiaomi": lambda photo, sharp: (
        photo + sharp + files.picture((SMALL // 2 + np.indices(SMALL.shape)[0] * 2).astype(np.uint8))
    ),
    "GDepth": lambda photo, sharp: files.with_segments(photo, files.gdepth_segments(MAP)) + sharp,
}


@pytest.mark.parametrize("kind", WITH_SHARP_PICTURE)
def test_the_sharp_picture_of_every_phone_is_shown(tmp_path, kind) -> None:
    blurred, sharp = blurred_and_sharp()
    found = opened(tmp_path, "a.jpg", WITH_SHARP_PICTURE[kind](blurred, sharp))
    assert_disc_is_nearest(found)
    (tmp_path / "sharp.jpg").write_bytes(sharp)
    np.testing.assert_allclose(found.photo.pixels, read_photo(tmp_path / "sharp.jpg").pixels, atol=1e-6)
    assert any("sharp picture" in note for note in found.photo.notes)
    if kind in ("Huawei", "Xiaomi", "GDepth"):  # the others state which picture is the sharp one
        found = opened(tmp_path, "a.jpg", WITH_SHARP_PICTURE[kind](sharp, blurred))
        assert not any("sharp picture" in note for note in found.photo.notes)


def test_copies_gain_maps_and_pictures_of_other_shapes_are_no_maps() -> None:
    picture, gain = Image.fromarray(PIXELS).convert("L"), files.picture(DEPTH)
    gain = gain[:2] + b"\xff\xe1\x00\x25http://ns.adobe.com/xap/1.0/\0<hdrgm>" + gain[2:]
    grey, small, matte = np.asarray(picture), np.asarray(picture.resize((64, 48))), np.where(DEPTH > 200, 255, 0)
    others = PIXELS, small, DEPTH[:40], np.roll(grey, 12, axis=1), 255 - grey, matte
    for behind in (gain, *(files.picture(other.astype(np.uint8)) for other in others)):
        assert embedded_in_jpeg(PHOTO + behind) is None


# ---- AVIF and HEIC


@pytest.mark.parametrize("orientation", [1, 6])
@pytest.mark.parametrize("white_is_near", [True, False])
def test_the_depth_of_an_avif(tmp_path, orientation, white_is_near) -> None:
    turns = 1 if orientation == 6 else 0  # stored a quarter turn counter-clockwise
    depth = DEPTH if white_is_near else 255 - DEPTH
    data = files.avif(np.rot90(PIXELS, turns), np.rot90(depth, turns), orientation)
    found = opened(tmp_path, "a.avif", data)
    assert found.photo.size == (96, 128)
    assert_disc_is_nearest(found)


def test_an_apple_portrait_in_a_heic_and_mattes_that_are_none(tmp_path) -> None:
    found = opened(tmp_path, "a.heic", files.heic(PIXELS, SMALL))
    assert_disc_is_nearest(found)
    assert found.origin.words == "the photo itself (Apple portrait)"
    kind = b"urn:com:apple:photo:2018:aux:portraiteffectsmatte"
    found = opened(tmp_path, "a.heic", files.heic(PIXELS, SMALL, auxiliary=kind))
    assert found.origin.kind == "rough"
    words = "a.heic holds mattes (portrait effects), which are no depth maps; this is not read."
    assert words in found.disparity.notes


@pytest.mark.parametrize(("orientation", "quarters"), [(1, 0), (3, 2), (6, 1), (8, -1)])
def test_the_map_of_a_samsung_heic_is_turned_with_its_photo(tmp_path, orientation, quarters) -> None:
    photo, stored = (np.ascontiguousarray(np.rot90(upright, quarters)) for upright in (PIXELS, 255 - SMALL))
    data = files.samsung_jpeg(files.heic(photo, orientation=orientation), stored)
    assert_disc_is_nearest(opened(tmp_path, "a.heic", data))


# ---- what is not read


def test_what_is_behind_a_photo_and_not_read_is_named(tmp_path) -> None:
    grey = files.picture(np.asarray(Image.fromarray(PIXELS).convert("L").resize((64, 48))))
    matte = files.apple_jpeg(b"", SMALL, 0, 1, "urn:com:apple:photo:2019:aux:semanticskinmatte")
    mask = files.picture(np.where(SMALL > 200, 255, 0).astype(np.uint8))
    xiaomi = b"PMPD\x02\0\x64\0\x01\0" + bytes(100)
    for behind, words in (
        (PHOTO, "a second picture (128x96, colour)"),
        (grey, "a second picture (64x48, grey)"),
        (mask, "a second picture (64x48, grey)"),
        (matte, "mattes (skin), which are no depth maps"),
        (xiaomi, "a depth map of Xiaomi's kind (PMPD)"),
    ):
        found = opened(tmp_path, "a.jpg", PHOTO + behind)
        assert found.origin.kind == "rough"
        assert f"a.jpg holds {words}; this is not read." in found.disparity.notes


def test_gain_maps_previews_and_plain_photos_need_no_words(tmp_path) -> None:
    path = tmp_path / "a.jpg"
    gain = files.with_segments(files.picture(SMALL), [files.STANDARD + b"<x hdrgm:Version='1.0'/>"])
    listed = PHOTO[:2] + b"\xff\xe2\0\x0aMPF\0\0\0\0\0" + PHOTO[2:] + PHOTO
    for data in (PHOTO, PHOTO + gain, listed, PHOTO + b"some other trailer", b"no photo"):
        path.write_bytes(data)
        assert unread_parts(path) == ()


JPEG_XL = (
    "AAAADEpYTCANCocKAAAAFGZ0eXBqeGwgAAAAAGp4bCAAAAAJanhsbAoAAADCanhsY/8KD8EEKrIyODo0CQgIEACgAksoNCa+5nOS"
    "UFBQUHIBFBSow4BjjFFRKNsY8y4TC0BExRjMO+ReXswYgyl7ARkAgE7EAQIDKAKKRrqQ2DIyEBhzHDAPI+aBAnHEPIRn89LQkAUX"
    "wgRUa6pq9c7wtls+f588RMsACn3QUhCNodcCZ1CHz1QEXrJoEIk+XbPBVql5J6cQPo5GIHzsXlqqWqzrn1BpwkMQbuPdHJcXtTS3"
    "Mo0mBpAlN+dCAg=="
)
"""A picture of 96x64 pixels with a further channel of depth."""


def test_a_channel_of_depth_in_jpeg_xl_is_named(tmp_path) -> None:
    data = base64.b64decode(JPEG_XL)
    found = opened(tmp_path, "a.jxl", data)
    assert found.origin.kind == "rough"
    (note,) = (note for note in found.disparity.notes if "depth channel" in note)
    assert "a_depth.png" in note
    codestream = data[data.index(b"\xff\x0a") :]
    for start, has_depth in ((codestream, True), (codestream[:5], False), (data[:40], False)):
        (tmp_path / "b.jxl").write_bytes(start)
        assert has_depth_channel(tmp_path / "b.jxl") is has_depth


# ---- Record3D


def test_the_first_frame_of_a_recording(tmp_path) -> None:
    lzfse = pytest.importorskip("lzfse", reason="the extra record3d is not installed")
    metres = 1 / (0.1 + SMALL / np.float32(255))
    stated = {"w": 128, "h": 96, "dw": 64, "dh": 48, "K": [100, 0, 0, 0, 100, 0, 64, 48, 1], "poses": []}
    with zipfile.ZipFile(tmp_path / "a.r3d", "w") as archive:
        archive.writestr("metadata", json.dumps(stated))
        for number, photo in ((10, files.grey_photo((96, 128))), (2, PHOTO)):
            archive.writestr(f"rgbd/{number}.jpg", photo)
            archive.writestr(f"rgbd/{number}.depth", lzfse.compress(metres.astype("<f4").tobytes()))
    found = open_with_depth(tmp_path / "a.r3d")
    assert_disc_is_nearest(found)
    assert found.photo.focal_px == pytest.approx(100)
    slope, offset = found.disparity.inverse_metres
    assert slope * found.disparity.values[60, 60] + offset == pytest.approx(0.1 + 230 / 255, rel=0.02)
    assert any("first of its 2 pictures" in note for note in found.photo.notes)
    (tmp_path / "b.r3d").write_bytes((tmp_path / "a.r3d").read_bytes()[:500])
    with pytest.raises(InputError, match=r"b\.r3d: is no recording of Record3D, or damaged"):
        read_photo(tmp_path / "b.r3d")


# ---- Lytro


def stack(is_illum: bool) -> bytes:
    """The disc is sharp at lambda -4, all else at 6."""
    disc, wall = (PIXELS.copy() for _ in range(2))
    is_disc = DEPTH == 230
    disc[~is_disc], wall[is_disc] = 200, 200
    focus = np.where(is_disc, -4.0, 6.0)
    pictures = {6.0: files.picture(wall, "PNG"), -4.0: files.picture(disc, "PNG")}
    return files.lytro_stack(pictures, focus, (96, 128), is_illum)


@pytest.mark.parametrize("is_illum", [True, False])
@pytest.mark.parametrize("name", ["IMG_0001-stk.lfp", "a.LFP", "a.jpg"])
def test_a_processed_lytro_file_opens_with_its_depth(tmp_path, name, is_illum) -> None:
    found = opened(tmp_path, name, stack(is_illum))
    assert found.origin.line == "Depth: the photo itself (Lytro)."
    assert found.disparity.values[60, 60] > found.disparity.values[4, 10]
    assert photo_size(tmp_path / name) == (96, 128)
    np.testing.assert_allclose(read_photo(tmp_path / name).pixels * 255, PIXELS, atol=1)


def test_cut_lytro_files_are_to_be_fetched_again_and_unknown_ones_exported(tmp_path) -> None:
    data = stack(True)
    for cut in (0.1, 0.5, 0.95):
        (tmp_path / "a.lfp").write_bytes(data[: int(cut * len(data))])
        with pytest.raises(InputError, match=r"^[^\n]*a\.lfp: cut off at [^\n]*; get the whole file again$"):
            read_photo(tmp_path / "a.lfp")
    entry = {"imageArray": [{"imageRef": "a", "width": 8}]}
    (tmp_path / "a.lfp").write_bytes(files.lytro_file(entry, {"a": b"x"}))
    with pytest.raises(InputError, match=r"in an unknown way \(no 'height'\); export it with Lytro Desktop"):
        read_photo(tmp_path / "a.lfp")
