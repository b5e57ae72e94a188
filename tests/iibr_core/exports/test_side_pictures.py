import struct
from pathlib import Path

import numpy as np
import pillow_heif
import pytest
from PIL import Image

from iibr_core.formats.images.heic import heic_pair
from iibr_core.formats.images.iso_boxes import associations, boxes
from iibr_core.formats.images.metadata import ARTIST, PictureMetadata
from iibr_core.formats.images.open_picture import read_metadata
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.scenes.screen_size import ScreenSize
from tests.iibr_core.exports.conftest import exported


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def test_colour_of_an_anaglyph_is_not_coarser_than_its_light(source, tmp_path) -> None:
    """Or the eyes would mix: WebP has it so without loss only."""
    png, webp, jpeg = (exported(source, "anaglyph", tmp_path / f"a{ending}") for ending in (".png", ".webp", ".jpg"))
    assert np.array_equal(pixels(webp), pixels(png))
    with Image.open(jpeg) as image:
        assert [layer[1:3] for layer in image.layer] == 3 * [(1, 1)]


@pytest.mark.parametrize("size", [(64, 96), (66, 98), (500, 342)])
def test_boxes_of_a_spatial_photo_are_as_apples(tmp_path, size) -> None:
    """4:2:0 of the Main Still Picture profile, whole; the left picture is the photo and the first of the pair."""
    eye = np.random.default_rng(0).integers(0, 256, (*size, 3), np.uint8)
    exif = Image.Exif()
    exif[ARTIST], exif.get_ifd(0x8769)[0x9003] = "A B", "2020:01:02 03:04:05"
    write_spatial_photo(tmp_path / "a.heic", eye, 255 - eye, 90.0, PictureMetadata(exif.tobytes()))
    kept = read_metadata(tmp_path / "a.heic").exif
    assert b"A B" in kept
    assert b"2020:01:02" in kept
    assert heic_pair(tmp_path / "a.heic") is not None
    top = list(boxes((tmp_path / "a.heic").read_bytes()))
    meta = dict(boxes(dict(top)[b"meta"][4:]))
    iprp = dict(boxes(meta[b"iprp"]))
    properties = list(boxes(iprp[b"ipco"]))
    kinds = [kind for kind, _ in properties]
    assert (top[0][0], top[0][1][:4], b"clap" in kinds) == (b"ftyp", b"heic", False)
    configured = [(content[1] & 31, content[16] & 3) for kind, content in properties if kind == b"hvcC"]
    assert set(configured) == {(3, 1)}, "profile and chroma format"
    assert {struct.unpack(">II", content[4:]) for kind, content in properties if kind == b"ispe"} == {size[::-1]}
    ((group, pair),) = boxes(meta[b"grpl"])
    _, _, count, left, right = struct.unpack(">IIIII", pair)
    assert (group, count, left != right, struct.unpack(">H", meta[b"pitm"][4:])) == (b"ster", 2, True, (left,))
    held = {item: [properties[k % 128 - 1][1] for k in ks] for item, ks in associations(iprp[b"ipma"])[0].items()}
    numbers = {item: [struct.unpack(">i", each[20:])[0] for each in ks if len(each) == 24] for item, ks in held.items()}
    assert numbers == {left: [293], right: [63_000, 293]}, "distance of the cameras in um, and where they are shown"
    means = [np.asarray(picture).mean() for picture in pillow_heif.open_heif(tmp_path / "a.heic")]
    assert means == pytest.approx([eye.mean(), 255 - eye.mean()], abs=2)


def test_libheif_knows_the_pair_and_its_cameras_at_twice_the_size(source, tmp_path) -> None:
    pytest.importorskip("pillow_heif", minversion="1.8")
    path = exported(source, "spatial-photo", tmp_path / "a.heic", size=ScreenSize(192, 128))
    file = pillow_heif.open_heif(path)
    (pair,) = file.info["entity_groups"]
    assert (pair["type"], pair["images"]) == ("ster", [0, 1])
    for picture in file:
        camera = picture.info["heif"]["camera_intrinsic_matrix"]
        assert camera["focal_length_x"] == pytest.approx(2 * source.focal_px)
        assert (camera["principal_point_x"], camera["principal_point_y"]) == (96, 64)
