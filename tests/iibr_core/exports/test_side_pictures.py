import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pillow_heif
import pytest
from PIL import Image

from iibr_core.beyond.optics import Optics
from iibr_core.exports.framing import side_pictures
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.images.heic import heic_pair
from iibr_core.formats.images.iso_boxes import associations, boxes
from iibr_core.formats.images.metadata import ARTIST, PictureMetadata
from iibr_core.formats.images.open_picture import read_metadata
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, InputError, ViewOffset
from tests.iibr_core.exports.conftest import exported


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def seen(source, s, width=96, height=64):
    return source.draw(RenderSettings(Optics(eye=ViewOffset(0.0, s)), ScreenSize(width, height))).astype(int)


def left_edge_of_square(picture: np.ndarray) -> float:
    """Column where the near square begins in the middle row, where its red is half of the maximum."""
    redness = (picture[..., 0] - picture[..., 2])[picture.shape[0] // 2].astype(float)
    start = int(np.argmax(redness > redness.max() / 2))
    before, after = redness[start - 1], redness[start]
    return start - (after - redness.max() / 2) / max(after - before, 1e-6)


def test_quilt_has_its_first_view_at_the_bottom_left(source, tmp_path) -> None:
    out = exported(source, "quilt", tmp_path / "a.png")
    assert out.name == "a_qs8x6a1.5.png"
    quilt = pixels(out)
    height, width = quilt.shape[0] // 6, quilt.shape[1] // 8
    assert (height, width) == (64, 96)
    for s, tile in ((-1.0, quilt[-height:, :width]), (1.0, quilt[:height, -width:])):
        assert np.abs(tile - seen(source, s)).max() <= 1
    assert np.abs(quilt[-height:, width : 2 * width] - seen(source, -1 + 2 / 47)).max() <= 1


@pytest.mark.parametrize(
    ("kind", "options", "first", "last"),
    [("quilt", {}, -2.0, 1.0), ("sbs", {}, -2.0, 1.0), ("anaglyph", {"eyes": 2.0}, -1.5, 0.5)],
)
def test_viewpoints_lie_about_the_middle_of_an_even_grid(source, tmp_path, kind, options, first, last) -> None:
    """Views of 4 columns lie from 2 steps left to 1 step right of the photo: their middle is half a step beside it."""
    drawn: list[RenderSettings] = []

    def draw(settings: RenderSettings) -> np.ndarray:
        drawn.append(settings)
        return np.zeros((settings.size_px.height, settings.size_px.width, 3), np.uint8)

    even = replace(source, scene=replace(source.scene, grid=GridShape(4, 4)), draw=draw)
    exported(even, kind, tmp_path / "a.png", {"focus_disparity": 3.0, "eye": ViewOffset(0.5, 1.0)}, **options)
    assert {settings.optics.eye.t for settings in drawn} == {0.5}, "all are seen from as high as the window's picture"
    assert (drawn[0].optics.eye.s, drawn[-1].optics.eye.s) == pytest.approx((first, last))
    shift_px = [96 * (settings.part.x + settings.part.width / 2 - 0.5) for settings in (drawn[0], drawn[-1])]
    assert shift_px == pytest.approx([-3.0 * first, -3.0 * last]), "the focused surface stays in place"


def test_the_focused_surface_stays_in_place(source) -> None:
    near = source.scene.disparity_range_px[1]
    places = {}
    for focus in (0.0, near):
        both = RenderSettings(Optics(focus_disparity=focus), ScreenSize(288, 192))
        drawn = [source.draw(eye).astype(int) for eye in side_pictures(source.scene, both, 2, 2.0)]
        left, right = map(left_edge_of_square, drawn)
        places[focus] = left - right
    assert places[near] == pytest.approx(0, abs=0.4)
    assert places[0.0] == pytest.approx(2 * near * 3, abs=0.8), "it moves by its disparity times the scale otherwise"


def test_a_focus_too_far_off_is_refused(source) -> None:
    with pytest.raises(InputError, match="too much for a common frame"):
        side_pictures(source.scene, RenderSettings(Optics(focus_disparity=30.0), ScreenSize(96, 64)), 2, 2.0)


def test_a_size_of_another_shape_shows_the_whole_picture_undistorted(source, tmp_path) -> None:
    out = pixels(exported(source, "cross-eyed", tmp_path / "a.png", size=ScreenSize(96, 100)))
    assert out.shape == (100, 192, 3)
    assert np.array_equal(out[18:82, :96], seen(source, 1.0))
    assert not out[:18].any()
    assert not out[82:].any()


def test_stereo_pictures(source, tmp_path) -> None:
    left, right = seen(source, -1.0), seen(source, 1.0)
    names = {"sbs": "a_LRF_Full_SBS.png", "over-under": "a_TB.png", "cross-eyed": "a.png"}
    pictures = np.hstack([left, right]), np.vstack([left, right]), np.hstack([right, left])
    for (kind, name), whole in zip(names.items(), pictures):
        out = exported(source, kind, tmp_path / "a.png")
        assert out.name == name
        assert np.array_equal(pixels(out), whole)
    half = exported(source, "half-sbs", tmp_path / "a_LRF_Half_SBS.png")
    assert (half.name, pixels(half).shape) == ("a_LRF_Half_SBS.png", (64, 96, 3))
    assert np.abs(pixels(half)[:, :48] - seen(source, -1.0, 48)).max() <= 1
    flat = exported(source, "half-over-under", tmp_path / "b.png")
    assert (flat.name, pixels(flat).shape) == ("b_HTAB.png", (64, 96, 3))
    assert np.abs(pixels(flat)[32:] - seen(source, 1.0, 96, 32)).max() <= 1


def test_colour_of_an_anaglyph_is_not_coarser_than_its_light(source, tmp_path) -> None:
    """Or the eyes would mix: WebP has it so without loss only."""
    png, webp, jpeg = (exported(source, "anaglyph", tmp_path / f"a{ending}") for ending in (".png", ".webp", ".jpg"))
    assert np.array_equal(pixels(webp), pixels(png))
    with Image.open(jpeg) as image:
        assert [layer[1:3] for layer in image.layer] == 3 * [(1, 1)]


def test_anaglyph_is_mixed_in_linear_light(source, tmp_path) -> None:
    """Dubois's matrices written out, for each eye alone, and cut off before they are added."""
    left_from_rgb = [[0.437, 0.449, 0.164], [-0.062, -0.062, -0.024], [-0.048, -0.050, -0.017]]
    right_from_rgb = [[-0.011, -0.032, -0.007], [0.377, 0.761, 0.009], [-0.026, -0.093, 1.234]]

    def light(encoded: np.ndarray) -> np.ndarray:
        x = encoded / 255
        return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)

    both = zip((left_from_rgb, right_from_rgb), (-1.0, 1.0))
    parts = [np.clip(np.einsum("ij,yxj->yxi", matrix, light(seen(source, s))), 0, 1) for matrix, s in both]
    linear = np.clip(sum(parts), 0, 1)
    encoded = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    out = pixels(exported(source, "anaglyph", tmp_path / "a.png"))
    assert np.abs(out - encoded * 255).max() <= 0.51


def test_both_pictures_of_a_spatial_photo_are_what_the_renderer_shows(source, tmp_path) -> None:
    path = exported(source, "spatial-photo", tmp_path / "a.heic")
    file = pillow_heif.open_heif(path)
    assert (len(file), file.primary_index) == (2, 0)
    for picture, s in zip(file, (-1.0, 1.0)):
        assert np.abs(np.asarray(picture).astype(int) - seen(source, s)).mean() < 3
    assert read_photo(path).size == (64, 96), "as an ordinary photo it is the left picture"


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
