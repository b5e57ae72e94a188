"""The scene: a wall that is far at its top, a disc before it on the left, a box on the right between both."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import PhotoWithDepth, open_with_depth
from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.maps.writer import MapText, write_map
from iibr_core.remedies import Remedy, remedy_of
from iibr_core.types import FloatImage, InputError

HEIGHT, WIDTH = 160, 240
DISC, BOX, WALL, TOP = (80, 68), (110, 170), (120, 20), (8, 60)


def scene(has_sky: bool = False) -> tuple[Image.Image, FloatImage]:
    """A photo, and its nearness, 0..1."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] / np.array([HEIGHT, WIDTH])[:, None, None]
    noise = np.random.default_rng(0).normal(0, 14, (HEIGHT, WIDTH))
    colors = np.stack([100 + noise, 120 + noise, 90 + noise], -1)
    near = 0.1 + 0.15 * y
    if has_sky:
        colors[y < 0.4], near[y < 0.4] = (140, 180, 230), 0
    box = (abs(x - 0.72) < 0.12) & (abs(y - 0.68) < 0.22)
    disc = np.hypot((x - 0.28) * WIDTH / HEIGHT, y - 0.5) < 0.22
    colors[box] = (np.array([50, 80, 190]) + noise[..., None])[box]
    colors[disc] = (np.array([200, 60, 50]) + noise[..., None])[disc]
    near[box], near[disc] = 0.5, 0.95
    return Image.fromarray(np.clip(colors, 0, 255).astype(np.uint8)), near.astype(np.float32)


def unit(near: FloatImage) -> FloatImage:
    return np.asarray((near - near.min()) / np.ptp(near))


def opened(folder: Path, name: str, picture: Image.Image | None = None, **choice: object) -> PhotoWithDepth:
    (scene()[0] if picture is None else picture).save(folder / "photo.png")
    wanted = replace(DepthChoice(file=str(folder / name), refine=False), **choice)
    return open_with_depth(folder / "photo.png", wanted)


def assert_true_to_scene(found: PhotoWithDepth) -> None:
    disc, box, wall, top = (found.disparity.values[place] for place in (DISC, BOX, WALL, TOP))
    assert disc > box > wall > top
    assert (disc - top) / (box - top) == pytest.approx(0.85 / 0.4, rel=0.1)


def integers(near: FloatImage, dtype: type, black_is_near: bool = False) -> Image.Image:
    values = 0.05 + 0.95 * unit(near)
    return Image.fromarray(((1 - values if black_is_near else values) * np.iinfo(dtype).max).astype(dtype))


@pytest.mark.parametrize("black_is_near", [False, True])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("name", ["map.png", "photo_depth.png"])
def test_integers_are_relative_and_the_photo_tells_which_end_is_near(tmp_path, name, dtype, black_is_near) -> None:
    integers(scene()[1], dtype, black_is_near).save(tmp_path / name)
    found = opened(tmp_path, name)
    assert_true_to_scene(found)
    assert np.ptp(found.disparity.values) < 0.02 * WIDTH
    assert found.origin.near == ("black" if black_is_near else "white")
    (note,) = (note for note in found.disparity.notes if f"{found.origin.near} counts as near" in note)
    assert remedy_of(note) is Remedy.INVERT
    if black_is_near and name == "map.png":
        assert_true_to_scene(opened(tmp_path, name, file_scale=-1.0))
    turned = opened(tmp_path, name, inverts=True)
    assert turned.origin.near == ("white" if black_is_near else "black")
    assert np.allclose(turned.disparity.values, -found.disparity.values, atol=1e-4)


def test_float_maps_are_disparity_and_warn_where_they_look_swapped(tmp_path) -> None:
    near = scene()[1]
    np.save(tmp_path / "map.npy", near * 4)
    assert np.allclose(opened(tmp_path, "map.npy").disparity.values, near * 4, atol=1e-5)
    np.save(tmp_path / "map.npy", near * -4)
    found = opened(tmp_path, "map.npy")
    assert found.disparity.values[DISC] < found.disparity.values[WALL]
    assert any("swapped" in note and "invert the depth" in note for note in found.disparity.notes)
    np.save(tmp_path / "photo_depth.npy", 3 + 5 * near)  # the name that many programs give inverse depth
    assert_true_to_scene(opened(tmp_path, "photo_depth.npy"))


@pytest.mark.parametrize("name", ["photo_depth.npy", "map.tif"])
def test_metres_are_metres(tmp_path, name) -> None:
    metres = (1 / (0.1 + scene()[1])).astype(np.float32)
    metres[40:44, 100:110] = 0  # no echo
    np.save(tmp_path / name, metres) if name.endswith("npy") else Image.fromarray(metres).save(tmp_path / name)
    found = opened(tmp_path, name, is_metric=name == "map.tif").disparity
    assert found.inverse_metres is not None
    slope, offset = found.inverse_metres
    assert slope * found.values[DISC] + offset == pytest.approx(1.05, rel=0.02)
    assert found.unknown[41, 105]
    Image.fromarray((metres * 1000).astype(np.uint16)).save(tmp_path / "photo_depth.png")
    millimetres = opened(tmp_path, "photo_depth.png")
    assert_true_to_scene(millimetres)
    np.testing.assert_allclose(millimetres.disparity.values, found.values, atol=0.05)


def holes() -> np.ndarray:
    """About a tenth of the map, in patches."""
    cells = np.random.default_rng(3).random((HEIGHT // 8, WIDTH // 8)) < 0.1
    return cells.repeat(8, 0).repeat(8, 1)


def slope() -> tuple[Image.Image, FloatImage]:
    """A textured surface whose photo does not show which end is near, and its inverse distance: the left is near."""
    colors = np.random.default_rng(1).normal(120, 14, (HEIGHT, WIDTH, 3))
    near = np.tile(np.linspace(1, 1 / 6, WIDTH), (HEIGHT, 1))
    return Image.fromarray(np.clip(colors, 0, 255).astype(np.uint8)), near.astype(np.float32)


def rotated(stored: np.ndarray) -> np.ndarray:
    return ((stored << 3) | (stored >> 13)).astype(np.uint16)


CAMERA_MAPS = {
    "millimetres": (lambda metres: np.where(holes(), 0, 1000 * metres).astype(np.uint16), 1),
    "65535 is unknown": (lambda metres: np.where(holes(), 65535, 1000 * metres).astype(np.uint16), 1),
    "65535 is unknown, in 32 bits": (lambda metres: np.where(holes(), 65535, 1000 * metres).astype(np.int32), 1),
    "5000 a metre": (lambda metres: 5 * np.where(holes(), 0, 1000 * metres).astype(np.uint16), 1),
    "7000 a metre": (lambda metres: np.where(holes(), 0, 7000 * metres).astype(np.uint16), 7),
    "rotated bits": (lambda metres: rotated(np.where(holes(), 0, 1500 * metres).astype(np.uint16)), 1.5),
    "millimetres of 32 bits, without holes": (lambda metres: (1000 * metres).astype(np.uint32), 1),
    "half floats": (lambda metres: np.where(holes(), 0, metres).astype(np.float16), 1),
}
"""Numbers of a depth camera's map by metres, and the ratio of the distances that are read to the true ones."""


@pytest.mark.parametrize("shows_near_end", [True, False])
@pytest.mark.parametrize("kind", CAMERA_MAPS)
def test_maps_of_depth_cameras_are_distances_by_their_numbers(tmp_path, kind, shows_near_end) -> None:
    photo, near = scene() if shows_near_end else slope()
    numbers, ratio = CAMERA_MAPS[kind]
    near = near + 0.2
    np.save(tmp_path / "photo_depth.npy", numbers(1 / near))
    found = opened(tmp_path, "photo_depth.npy", photo).disparity
    slope_, offset = found.inverse_metres
    known = ~holes()
    np.testing.assert_allclose((slope_ * found.values + offset)[known], near[known] / ratio, rtol=0.01, atol=0.004)
    assert found.unknown is None or not found.unknown[known].any()


def test_doubt_about_the_near_end_names_both_ways_out(tmp_path) -> None:
    photo, near = slope()
    integers(1 - near, np.uint8).save(tmp_path / "photo_depth.png")
    (note,) = opened(tmp_path, "photo_depth.png", photo).disparity.notes
    assert "white counts as near, as usual, in doubt" in note
    assert remedy_of(note) is Remedy.INVERT_OR_METRIC


@pytest.mark.parametrize("name", ["depth", "predicted_depth"])
def test_an_array_that_is_named_depth_holds_distances(tmp_path, name) -> None:
    photo, near = slope()
    np.savez(tmp_path / "a.npz", **{name: 1 / near, "focallength_px": 500.0})
    values = opened(tmp_path, "a.npz", photo).disparity.values
    assert values[80, 10] > values[80, 230]
    np.save(tmp_path / "a.npy", 1 / near)
    notes = opened(tmp_path, "a.npy", photo).disparity.notes
    assert any("metric" in note and remedy_of(note) is Remedy.INVERT_OR_METRIC for note in notes)
    values = opened(tmp_path, "a.npy", photo, is_metric=True).disparity.values
    assert values[80, 10] > values[80, 230]


def test_a_sky_of_zeros_is_far_away_and_scattered_zeros_are_unknown(tmp_path) -> None:
    photo, near = scene(has_sky=True)
    Image.fromarray((unit(near) * 255).astype(np.uint8)).save(tmp_path / "map.png")
    values = opened(tmp_path, "map.png", photo).disparity.values
    assert values[TOP] < values[WALL] < values[BOX] < values[DISC]
    assert values[TOP] == pytest.approx(values[5, 200])
    stored = np.maximum(np.array(integers(scene()[1] + 1, np.uint8)), 80)
    stored[::3, ::5] = 0
    Image.fromarray(stored).save(tmp_path / "map.png")
    unknown = opened(tmp_path, "map.png").disparity.unknown
    assert unknown[::3, ::5].all()


@pytest.mark.parametrize("name", ["map.jpg", "map.webp", "RGBA.png", "P.png"])
def test_pictures_of_all_kinds_are_read_alike(tmp_path, name) -> None:
    mode = Path(name).stem if Path(name).stem.isupper() else "RGB"
    integers(scene()[1], np.uint8).convert(mode).save(tmp_path / name, quality=85)
    assert_true_to_scene(opened(tmp_path, name))


@pytest.mark.parametrize("scale", ["TURBO", "INFERNO"])
def test_maps_drawn_in_colours_are_read_back(tmp_path, scale) -> None:
    grey = np.array(integers(scene()[1], np.uint8))
    cv2.imwrite(str(tmp_path / "map.jpg"), cv2.applyColorMap(grey, getattr(cv2, f"COLORMAP_{scale}")))
    found = opened(tmp_path, "map.jpg")
    assert_true_to_scene(found)
    assert any(f"colours of {scale.lower()}" in note for note in found.disparity.notes)
    scene()[0].save(tmp_path / "photo.jpg")
    with pytest.raises(InputError, match=r"photo\.jpg: is a colour picture; .*save it as grey"):
        opened(tmp_path, "photo.jpg")


def test_black_in_a_coloured_map_is_unknown_and_a_circle_of_hues_is_refused(tmp_path) -> None:
    grey = np.array(integers(scene()[1], np.uint8))
    for name, jet in (("a.png", "JET"), ("a.jpg", "TURBO")):
        colors = cv2.applyColorMap(grey, getattr(cv2, f"COLORMAP_{jet}"))
        colors[holes()] = 0
        cv2.imwrite(str(tmp_path / name), colors)
        found = opened(tmp_path, name)
        assert_true_to_scene(found)
        assert found.disparity.unknown[holes()].mean() > 0.95
    hues = np.dstack([grey, *[np.full_like(grey, 255)] * 2])
    Image.fromarray(hues, "HSV").convert("RGB").save(tmp_path / "hsv.png")
    with pytest.raises(InputError, match=r"circle of hues .*; save it as grey"):
        opened(tmp_path, "hsv.png")


def test_a_squashed_map_is_refused_with_the_way_out(tmp_path) -> None:
    integers(scene()[1], np.uint8).resize((112, 112)).save(tmp_path / "map.png")
    with pytest.raises(InputError, match=r"112x112 .* 240x160; crop or rotate it"):
        opened(tmp_path, "map.png")
    found = opened(tmp_path, "map.png", stretches=True)
    assert_true_to_scene(found)
    assert any("stretched" in note for note in found.disparity.notes)


@pytest.mark.parametrize(("orientation", "back"), [(3, Image.Transpose.ROTATE_180), (6, Image.Transpose.ROTATE_90)])
def test_a_map_lies_like_the_stored_photo_or_is_turned_itself(tmp_path, orientation, back) -> None:
    photo, near = scene()
    exif = Image.Exif()
    exif[0x0112] = orientation
    photo.transpose(back).save(tmp_path / "turned.jpg", quality=95, exif=exif)
    grey = integers(near, np.uint8)
    grey.save(tmp_path / "upright.png")
    grey.transpose(back).save(tmp_path / "stored.png")
    grey.transpose(back).convert("RGB").save(tmp_path / "own_exif.jpg", quality=95, exif=exif)
    grey.paste(0, (0, 0, 3, 2))
    grey.transpose(back).save(tmp_path / "zeros.png")
    for name in ("upright.png", "stored.png", "own_exif.jpg", "zeros.png"):
        choice = DepthChoice(file=str(tmp_path / name), refine=False)
        assert_true_to_scene(open_with_depth(tmp_path / "turned.jpg", choice))
    ramp = np.tile(np.linspace(0, 4, HEIGHT, dtype=np.float32)[:, None], (1, WIDTH))
    np.save(tmp_path / "ramp.npy", ramp)
    found = open_with_depth(tmp_path / "turned.jpg", DepthChoice(file=str(tmp_path / "ramp.npy"), refine=False))
    np.testing.assert_allclose(found.disparity.values, ramp, atol=1e-5, err_msg="in doubt a map is upright")


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_our_own_maps_come_back(tmp_path, suffix) -> None:
    disparity = 4 * scene()[1] - 1
    write_map(tmp_path / f"a{suffix}", disparity)
    assert np.allclose(opened(tmp_path, f"a{suffix}").disparity.values, disparity, atol=1e-3)
    depth, text = 6 / (disparity + 2), MapText("depth", unit="distances of the nearest", inverse=(6.0, -2.0))
    write_map(tmp_path / f"a_depth{suffix}", depth, text)
    assert np.allclose(opened(tmp_path, f"a_depth{suffix}").disparity.values, disparity, atol=1e-2)
    write_map(tmp_path / f"b_depth{suffix}", depth, MapText("depth", unit="m"))
    assert opened(tmp_path, f"b_depth{suffix}").disparity.inverse_metres is not None


@pytest.mark.parametrize("prefixes", [("", ""), ("ViewLayer.Combined.", "ViewLayer.Depth.")])
def test_the_depth_channel_of_a_rendered_picture(tmp_path, prefixes) -> None:
    photo, near = scene(has_sky=True)
    names = (*(prefixes[0] + name for name in "RGBA"), prefixes[1] + "Z")
    depth = np.where(near > 0, 1 / np.maximum(near, 0.05), 1e10)
    pixels = np.dstack([np.asarray(photo, np.float32) / 255, np.ones_like(near), depth]).astype(np.float32)
    write_image_file(tmp_path / "render.exr", pixels, "float", channels=names)
    found = open_with_depth(tmp_path / "render.exr", DepthChoice(refine=False))
    assert found.origin.kind == "embedded"
    values = found.disparity.values
    assert values[TOP] < values[WALL] < values[BOX] < values[DISC]
    assert np.isfinite(values).all()


@pytest.mark.parametrize("name", ["photo_rgbd.jpg", "IMG_1.png", "below.jpg", "left_RGBD.png"])
def test_a_picture_with_its_map_beside_it_in_one_file(tmp_path, name) -> None:
    photo, near = scene()
    grey = integers(near, np.uint8).convert("RGB")
    parts = (grey, photo) if name.startswith("left") else (photo, grey)
    both = np.concatenate([np.asarray(part) for part in parts], axis=0 if name.startswith("below") else 1)
    if name.startswith("below"):
        both = both[:, :150]  # halves one over the other are looked for in high pictures
    Image.fromarray(both).save(tmp_path / name, quality=95)
    found = open_with_depth(tmp_path / name, DepthChoice(refine=False))
    assert found.photo.size == (HEIGHT, 150 if name.startswith("below") else WIDTH)
    assert found.origin.kind == "embedded"
    values = found.disparity.values
    assert values[DISC] > values[WALL] > values[TOP]
