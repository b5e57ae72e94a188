import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.embedded.embedded import read_embedded
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.heic import heic_pair
from iibr_core.formats.images.iso_boxes import with_primary
from iibr_core.formats.images.picture_source import PictureSource, read_source
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.formats.light_fields import views as views_module
from iibr_core.formats.light_fields.light_field_formats import find_light_field, is_light_field, open_light_field
from iibr_core.formats.light_fields.views import read_views
from iibr_core.formats.quilts import MAX_USUAL_SIDE_PX, Quilt, lay_out, quilt_for, quilt_named, tagged
from iibr_core.scenes.light_fields import find_disparity
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset
from tests.iibr_core.embedded_files import picture
from tests.iibr_core.known_scenes import FOREGROUND, view_of_square

HEIGHT, WIDTH = 6, 9
RNG = np.random.default_rng(0)


def pictures(count: int, height: int = HEIGHT, width: int = WIDTH) -> list[np.ndarray]:
    return [RNG.integers(0, 256, (height, width, 3), np.uint8) for _ in range(count)]


def read_back(path: Path) -> dict[tuple[int, int], np.ndarray]:
    size, views = read_views(open_light_field(path))
    by_place = {(view.row, view.column): view.colors for view in views}
    assert all(colors.shape == (*size, 3) for colors in by_place.values())
    return by_place


def write_quilt(folder: Path, quilt: Quilt, tiles: list[np.ndarray]) -> Path:
    path = folder / f"scene{quilt.tag}.png"
    Image.fromarray(lay_out(quilt, tiles)).save(path)
    return path


@pytest.mark.parametrize(("columns", "rows"), [(3, 2), (45, 1), (1, 45), (8, 6)])
def test_quilts_are_read_as_they_are_written_and_decoded_once(tmp_path, monkeypatch, columns, rows) -> None:
    size, tiles = ImageSize(rows * HEIGHT + (rows > 1), columns * WIDTH + (columns > 1)), pictures(columns * rows)
    path = write_quilt(tmp_path, Quilt(columns, rows, size, WIDTH / HEIGHT), tiles)
    assert is_light_field(path)
    scene = open_light_field(path)
    assert (scene.name, scene.grid) == ("scene", GridShape(1, len(tiles)))
    decoded = []
    monkeypatch.setattr(views_module, "read_source", lambda source: decoded.append(source) or read_source(source))
    views = read_back(path)
    for k, tile in enumerate(tiles):
        np.testing.assert_array_equal(views[0, k], tile)
    assert decoded == [PictureSource(path)]


COPIES = ["", " (1)", "(2)", " - Copy", " - Copy (2)", "_copy", " copy 2", "-1", "_0001"]
"""What browsers, file managers and renderers of animations add to names."""


@pytest.mark.parametrize("copy", COPIES)
def test_copies_of_quilts_and_lenslet_images_open_by_their_names(tmp_path, copy) -> None:
    tiles = pictures(45)
    quilt = Quilt(45, 1, ImageSize(HEIGHT, 45 * WIDTH), 0.75)
    path = write_quilt(tmp_path, quilt, tiles).rename(tmp_path / f"scene{quilt.tag}{copy}.png")
    scene = open_light_field(path)
    assert (is_light_field(path), scene.name, scene.grid) == (True, "scene", GridShape(1, 45))
    lenslet = tmp_path / f"scene_eslf{copy}.png"
    Image.fromarray(RNG.integers(0, 256, (14 * 3, 14 * 5, 3), np.uint8)).save(lenslet)
    assert (open_light_field(lenslet).name, open_light_field(lenslet).grid) == ("scene", GridShape(8, 8))


def smooth(height: int = 48, width: int = 64, shift: int = 0) -> np.ndarray:
    y, x = np.mgrid[0:height, 0:width]
    return np.stack([127 + 100 * np.sin((x + shift) / 9), 2.0 * y, x + 0.0 * y], -1).astype(np.uint8)


def write_mpo(path: Path, left: np.ndarray, right: np.ndarray) -> None:
    Image.fromarray(left).save(path, "MPO", save_all=True, append_images=[Image.fromarray(right)], quality=95)


def write_stereo_jpeg(path: Path, left: np.ndarray, right: np.ndarray) -> None:
    """Write what cameras write: both pictures are marked as an eye's."""
    write_mpo(path, left, right)
    stored = path.read_bytes()
    entries = stored.index(struct.pack("<I", 0x030000), stored.index(b"MPF") + 20)
    changed = bytearray(stored)
    changed[entries : entries + 4] = struct.pack("<I", 0x020002)
    changed[entries + 16 : entries + 20] = struct.pack("<I", 0x020002)
    path.write_bytes(changed)


def lif(left: np.ndarray, described: bytes, *more: tuple[int, bytes]) -> bytes:
    """Return a Leia image. described: JSON about its views. more: numbered pictures beside the left one."""
    fields = [(0, b"\0\0\0\4"), (8, described), *more]
    body = b"".join(struct.pack(">II", number, len(data)) + data for number, data in fields)
    region = struct.pack(">I", len(fields)) + body
    return picture(left) + region + struct.pack(">I", len(region) + 6) + b"\x1e\x1a"


def leia_image(left: np.ndarray, right: np.ndarray, *more: tuple[int, bytes], **inner: object) -> bytes:
    views = [
        {"image": {"blob_id": 10}, "position": {"x": 0.03, "y": 0, "z": 0}},
        {"image": {"blob_id": -1}, "position": {"x": -0.03, "y": 0, "z": 0}, **inner},
    ]
    return lif(left, json.dumps({"views": views}).encode(), (10, picture(right)), *more)


def lume_pad_2(left: np.ndarray, right: np.ndarray, *more: tuple[int, bytes]) -> bytes:
    """Return an image of a Lume Pad 2; more: a map numbered 1000002."""
    views = [
        {"albedoId": 1000001, "disparityId": 0, "monodisparityId": 0, "xLocation": 1.0, "yLocation": 0.0},
        {"albedoId": -1, "disparityId": 1000002 if more else 0, "monodisparityId": 0, "xLocation": 0, "yLocation": 0},
    ]
    described = json.dumps({"disparitySource": "LEIA_STEREO", "views": views}).encode()
    return lif(left, described, (1000001, picture(right)), *more)


def test_a_spatial_photo_may_show_its_right_picture_but_no_unknown_one(tmp_path) -> None:
    path, left, right = tmp_path / "a.heic", smooth(), smooth(shift=4)
    write_spatial_photo(path, left, right, 80.0)
    path.write_bytes(with_primary(path.read_bytes(), heic_pair(path)[1]))
    views = read_back(path)
    assert np.abs(views[0, 0].astype(int) - left).mean() < 3
    assert np.abs(views[0, 1].astype(int) - right).mean() < 3
    whole, pair = path.read_bytes(), struct.pack(">III", 2, 1, 2)
    for items in ((1, 77), (1, 1)):
        path.write_bytes(whole.replace(pair, struct.pack(">III", 2, *items)))
        with pytest.raises(InputError, match=r"a\.heic.*(unknown way \(by pictures \[1, 1\]\)|non-existing image)"):
            read_back(path)


def test_jpegs_with_other_pictures_are_no_stereo(tmp_path) -> None:
    """Gain maps and previews are stored the same way."""
    write_mpo(tmp_path / "phone.jpg", smooth(), smooth(24, 32))
    assert find_light_field(tmp_path / "phone.jpg") is None
    Image.fromarray(smooth()).save(tmp_path / "single.mpo", "JPEG")
    with pytest.raises(InputError, match="holds one picture only"):
        find_light_field(tmp_path / "single.mpo")


GREY = np.tile(np.arange(64, dtype=np.uint8) * 3, (48, 1))
WITH_MAP: dict[str, bytes] = {
    "5.3": leia_image(
        smooth(), smooth(shift=4), (11, picture(GREY)), inv_z_map={"blob_id": 11, "min": 0.4, "max": 0.01}
    ),
    "lume pad 2": lume_pad_2(smooth(), smooth(shift=4), (1000002, picture(GREY))),
}


@pytest.mark.parametrize("version", WITH_MAP)
def test_a_leia_image_contains_inverse_depth(tmp_path, version) -> None:
    """White is near."""
    path = tmp_path / "a.jpg"
    path.write_bytes(WITH_MAP[version])
    depth = read_embedded(path)
    assert (depth.format, depth.estimate.meaning) == ("Leia", "inverse depth")
    np.testing.assert_allclose(depth.estimate.values, GREY / 255, atol=0.02)
    path.write_bytes(lume_pad_2(smooth(), smooth(shift=4)))
    assert read_embedded(path) is None


UNKNOWN = "save it side by side with Leia's program, under a name that ends in '_2x1'"
AGAIN = "get the whole file again"
BAD_LEIA: dict[str, tuple[bytes, str]] = {
    "unknown keys": (b'{"views": [{"picture": 1}]}', f"in an unknown way (no 'image'); {UNKNOWN}"),
    "no number": (b'{"views": [{"image": {"file": 1}}]}', f"in an unknown way (no 'blob_id'); {UNKNOWN}"),
    "another form": (b'{"views": {"left": -1}}', f"; {UNKNOWN}"),
    "no views": (b'{"views": []}', f"list no views; {UNKNOWN}"),
    "missing picture": (b'{"views": [{"albedoId": 7000}]}', "lack the pictures [7000], which they name"),
    "cut text": (b'{"views": [{"albe', AGAIN),
}


@pytest.mark.parametrize("fault", BAD_LEIA)
def test_only_damaged_leia_images_are_to_be_fetched_again(tmp_path, fault) -> None:
    described, advice = BAD_LEIA[fault]
    path = tmp_path / "a.lif"
    path.write_bytes(lif(smooth(), described))
    with pytest.raises(InputError, match=re.escape(advice)) as raised:
        open_light_field(path)
    assert (AGAIN in str(raised.value)) == (advice == AGAIN)
    stored = lume_pad_2(smooth(), smooth(shift=4))
    for cut in (stored[:-100], stored[:-600] + stored[-400:]):
        path.write_bytes(cut)
        with pytest.raises(InputError, match=AGAIN):
            open_light_field(path)


@pytest.mark.parametrize("view", [ImageSize(64, 96), ImageSize(3000, 4000), ImageSize(5000, 300), ImageSize(900, 9)])
def test_for_any_display_views_keep_their_shape_and_are_never_larger(view) -> None:
    quilt = quilt_for(None, view)
    assert (quilt.aspect, quilt.views) == (view.width / view.height, 48)
    assert max(quilt.size) <= MAX_USUAL_SIDE_PX + 8
    assert all(1 <= side <= full for side, full in zip(quilt.tile, view))
    if view.width > 900:
        assert quilt.tile.width / quilt.tile.height == pytest.approx(quilt.aspect, rel=0.03)


def test_views_are_laid_out_from_the_lower_left_and_a_name_states_the_quilt() -> None:
    """The remainder stays black. A name gets one tag."""
    quilt = Quilt(3, 2, ImageSize(9, 13), 1.0)
    whole = lay_out(quilt, [np.full((4, 4, 3), 10 * (view + 1), np.uint8) for view in range(6)])
    assert (whole[8, 0, 0], whole[8, 11, 0], whole[1, 0, 0]) == (10, 30, 40)
    assert not whole[0].any()
    assert not whole[:, 12].any()
    quilt = quilt_named(Path("a_qs8x6a0.75.png"), ImageSize(60, 80))
    assert quilt == Quilt(8, 6, ImageSize(60, 80), 0.75)
    assert tagged(tagged(Path("b/a.png"), quilt.tag), quilt.tag) == Path("b/a_qs8x6a0.75.png")
    assert quilt_named(Path("a.png"), ImageSize(60, 80)) is None
    assert quilt_named(Path("a_qs8x6a0.75z1.2f0.0.png"), ImageSize(60, 80)) == quilt
    for name, fault in (("a_qs8x6a0.75.png", "too few"), ("a_qs5x300a1.png", "more than 1024 views")):
        with pytest.raises(InputError, match=fault):
            quilt_named(Path(name), ImageSize(5, 8) if fault == "too few" else ImageSize(900, 900))


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("left.png", "right.png"),
        ("DSC_7_L.png", "DSC_7_R.png"),
        ("r/l-3.png", "r/r-3.png"),
        ("imgLeft.png", "imgRight.png"),
    ],
)
def test_two_files_are_a_pair_where_names_and_pictures_agree(tmp_path, left, right) -> None:
    (tmp_path / "r").mkdir()
    for name, s in ((left, 0), (right, 2)):
        Image.fromarray((view_of_square(ViewOffset(0, s)) * 255).astype(np.uint8)).save(tmp_path / name)
    for path in (tmp_path / right, (tmp_path / left).parent):
        scene = open_light_field(path)
        assert [view.path for view in scene.views] == [tmp_path / left, tmp_path / right]
        assert scene.layout == "stereo, two files"
    Image.fromarray(pictures(1, 40, 48)[0]).save(tmp_path / right)
    assert find_light_field(tmp_path / left) is None
    (tmp_path / right).write_bytes(b"no picture")
    assert find_light_field(tmp_path / left) is None


def test_two_pictures_of_one_scene_are_a_pair_under_any_names(tmp_path) -> None:
    folder = tmp_path / "two"
    folder.mkdir()
    for name, s in (("a.png", 0), ("b.png", 2)):
        Image.fromarray((view_of_square(ViewOffset(0, s)) * 255).astype(np.uint8)).save(folder / name)
    assert find_light_field(folder) is None
    _, values, _ = find_disparity(Source(str(folder)))
    assert np.median(values[16:24, 20:28]) == pytest.approx(2 * FOREGROUND, abs=0.4)
    found = open_with_depth(folder / "a.png", DepthChoice(right=str(folder / "b.png")))
    assert found.origin.words == "the photo's two views (stereo, two files)"
    assert np.median(found.disparity.values[16:24, 20:28]) == pytest.approx(2 * FOREGROUND, abs=0.6)
