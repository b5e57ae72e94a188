"""Maps of a drawn scene beside its photo, in all numbers and kinds of files, are opened and compared with it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.maps.writer import MapText, write_map
from iibr_core.remedies import Remedy, remedy_of
from iibr_core.types import FloatImage, GridShape, InputError
from tests.iibr_core.depth.drawn_photo import (
    HEIGHT,
    LOSSY,
    WIDTH,
    as_bytes,
    assert_as_kept,
    assert_disparity,
    assert_metres,
    drawn,
    save,
    slope,
    stored_as,
    unit,
    usual_disparity,
)
from tests.iibr_core.depth.test_sheets import assert_sheet
from tests.iibr_core.formats.test_color_profile import profile_bytes

Write = Callable[[Path, FloatImage], object]
CORNER = np.s_[40:44, 100:110]
HOLES = (np.random.default_rng(3).random((HEIGHT // 8, WIDTH // 8)) < 0.1).repeat(8, 0).repeat(8, 1)
"""About a tenth of the map, in patches."""


def spread(near: FloatImage, dtype: type = np.uint8, black_is_near: bool = False) -> np.ndarray:
    values = 0.05 + 0.95 * unit(near)
    return np.asarray(((1 - values if black_is_near else values) * np.iinfo(dtype).max).astype(dtype))


def integers(dtype: type = np.uint8, black_is_near: bool = False, step: int = 1, **options: Any) -> Write:
    return lambda path, near: save(path, spread(near, dtype, black_is_near)[::step, ::step], **options)


def array(numbers: Callable[[FloatImage], np.ndarray]) -> Write:
    """Write a file of numpy's; numbers: from inverse distances."""
    return lambda path, near: np.save(path, numbers(near))


def metres(near: FloatImage) -> FloatImage:
    distances = (1 / near).astype(np.float32)
    distances[CORNER] = 0  # no echo
    return distances


def rotated(stored: np.ndarray) -> np.ndarray:
    return ((stored << 3) | (stored >> 13)).astype(np.uint16)


def sky_of_65535(path: Path, near: FloatImage) -> None:
    save(path, np.where(near > 0, 1000 / np.maximum(near, 0.05), 65535).astype(np.uint16))


def low_and_zero(near: FloatImage) -> np.ndarray:
    """Zeros are no holes here: other values begin just above them."""
    stored = (3 + 252 * unit(near)).astype(np.uint8)
    stored[HOLES] = 0
    return stored


def scattered_zeros(near: FloatImage) -> np.ndarray:
    stored = np.maximum(spread(near), 80)
    stored[::3, ::5] = 0
    return stored


def in_mode(mode: str) -> Write:
    return lambda path, near: Image.fromarray(spread(near)).convert(mode).save(path, quality=85)


def in_colors(scale: str, with_holes: bool = False) -> Write:
    def write(path: Path, near: FloatImage) -> None:
        colors = cv2.applyColorMap(spread(near), getattr(cv2, f"COLORMAP_{scale}"))
        colors[HOLES & with_holes] = 0
        cv2.imwrite(str(path), colors)

    return write


def own_depth(text: MapText) -> Write:
    return lambda path, near: write_map(path, 6 / (4 * near + 1), text)


def same(near: FloatImage) -> FloatImage:
    return near


def turned_round(near: FloatImage) -> FloatImage:
    return -usual_disparity(near)


NOTHING: Mapping[str, Any] = MappingProxyType({})


class Row(NamedTuple):
    """map: name of its file, found by its name if that begins with that of the photo. write: it.

    choice: of the user. expected: disparity, None for that of relative depth. metres: 1 / m, if that is known.
    scene: photo and inverse distances. opened: options of `open_with_depth`; saved: of writing the photo.
    """

    map: str
    write: Write
    choice: Mapping[str, Any] = NOTHING
    expected: Callable[[FloatImage], FloatImage] | None = None
    metres: Callable[[FloatImage], FloatImage] | None = None
    scene: tuple[np.ndarray, FloatImage] = drawn()
    orientation: int = 1
    atol: float = LOSSY
    opened: Mapping[str, Any] = NOTHING
    saved: Mapping[str, Any] = NOTHING


INVERTS, METRIC = {"inverts": True}, {"is_metric": True}
METRES = MapText("depth", unit="m")
ROWS = {
    "8 bits, half as large": Row("map.png", integers(step=2)),
    "8 bits, black near": Row("photo_depth.png", integers(black_is_near=True)),
    "8 bits, black near, by hand": Row("map.png", integers(black_is_near=True), {"file_scale": -1.0}),
    "8 bits, black near, inverted": Row("photo_depth.png", integers(black_is_near=True), INVERTS, turned_round),
    "16 bits, one row of views": Row("map.png", integers(np.uint16), opened={"grid": GridShape(1, 5)}),
    "16 bits, black near, inverted": Row("map.png", integers(np.uint16, True), INVERTS, turned_round),
    "8 bits, stretched": Row(
        "map.png", lambda p, n: save(p, cv2.resize(spread(n), (112, 112))), {"stretches": True}, atol=0.06
    ),
    "8 bits that begin above 0": Row("map.png", lambda p, n: save(p, low_and_zero(n)), atol=np.inf),
    "16 bits, holes of 0 just below the rest": Row(
        "map.png", lambda p, n: save(p, np.where(HOLES, 0, 701 + 64000 * unit(n)).astype(np.uint16))
    ),
    "a photo in Display P3": Row("map.png", integers(), saved={"icc_profile": profile_bytes()}),
    "jpeg": Row("map.jpg", in_mode("RGB"), atol=0.1),
    "webp": Row("map.webp", in_mode("RGB"), atol=0.06),
    "rgba": Row("map.png", in_mode("RGBA")),
    "palette": Row("map.png", in_mode("P")),
    "turbo": Row("map.jpg", in_colors("TURBO"), atol=0.08),
    "inferno": Row("map.jpg", in_colors("INFERNO"), atol=0.08),
    "turbo with holes": Row("a.jpg", in_colors("TURBO", True), atol=0.12),
    "jet with holes": Row("a.png", in_colors("JET", True), atol=0.06),
    "scattered zeros are unknown": Row("map.png", lambda p, n: save(p, scattered_zeros(n)), atol=np.inf),
    "a sky of zeros is far": Row("map.png", lambda p, n: save(p, as_bytes(unit(n))), scene=drawn(True)),
    "floats": Row("map.npy", array(lambda n: 4 * n), expected=lambda n: 4 * n),
    "floats of half the size, scaled": Row(
        "map.npy", array(lambda n: (4 * n - 1)[::2, ::2]), {"file_scale": 0.5}, lambda n: 4 * n - 1
    ),
    "floats, turned by a scale": Row("map.npy", array(lambda n: -4 * n), {"file_scale": -2.0}, lambda n: 8 * n),
    "floats, swapped": Row("map.npy", array(lambda n: -4 * n), expected=lambda n: -4 * n),
    "floats above 0, swapped": Row("map.npy", array(lambda n: 5 - 4 * n), expected=lambda n: 5 - 4 * n),
    "floats, inverted": Row("map.npy", array(lambda n: -4 * n), INVERTS, lambda n: 4 * n),
    "pfm": Row("photo.pfm", lambda p, n: write_pfm(p, 4 * n), expected=lambda n: 4 * n),
    "floats named depth are relative": Row("photo_depth.npy", array(lambda n: 3 + 5 * n)),
    "metres of half the size": Row("photo_depth.npy", array(lambda n: metres(n)[::2, ::2]), metres=same, atol=0.1),
    "metres, inverted": Row(
        "photo_depth.npy", array(lambda n: metres(n)), INVERTS, lambda n: usual_disparity(1 / n), atol=0.1
    ),
    "millimetres, the sky is 65535": Row("photo_depth.png", sky_of_65535, metres=same, atol=0.1, scene=drawn(True)),
    "millimetres without a name": Row(
        "map.npy", lambda p, n: np.save(p, (1000 / n).astype(np.uint16)), metres=same, scene=slope(), atol=np.inf
    ),
    "metres as said": Row("map.tif", lambda p, n: Image.fromarray(metres(n)).save(p), METRIC, metres=same, atol=0.1),
    "millimetres": Row(
        "photo_depth.png", lambda p, n: save(p, (1000 * metres(n)).astype(np.uint16)), metres=same, atol=0.1
    ),
    "millimetres said to be relative": Row(
        "map.png", lambda p, n: save(p, (1000 * metres(n)).astype(np.uint16)), {"file_scale": -1.0}, metres=same,
        atol=0.1,
    ),
    "ours, 16 bits": Row("a.png", lambda p, n: write_map(p, 4 * n - 1), expected=lambda n: 4 * n - 1),
    "ours, exr, half the size": Row(
        "a.exr", lambda p, n: write_map(p, (4 * n - 1)[::2, ::2]), expected=lambda n: 8 * n - 2
    ),
    "ours, distances of the nearest": Row(
        "a_depth.png",
        own_depth(MapText("depth", unit="distances of the nearest", inverse=(6.0, -2.0))),
        expected=lambda n: 4 * n - 1,
    ),
    "ours, inverted metres": Row(
        "b_depth.exr", own_depth(METRES), INVERTS, lambda n: usual_disparity(1 / (4 * n + 1)), atol=0.1
    ),
    "ours, metres": Row("b_depth.exr", own_depth(METRES), metres=lambda n: (4 * n + 1) / 6),
    "depth of an npz": Row(
        "a.npz", lambda p, n: np.savez(p, predicted_depth=1 / n, focallength_px=500.0), scene=slope(), metres=same
    ),
    "distances without a name": Row("a.npy", array(lambda n: 1 / n), expected=lambda n: 1 / n, scene=slope()),
    "distances without a name, as said": Row("a.npy", array(lambda n: 1 / n), METRIC, metres=same, scene=slope()),
    "in doubt": Row("photo_depth.png", integers(), scene=slope()),
}  # fmt: skip


def open_row(folder: Path, row: Row):
    photo, near = row.scene
    path = save(folder / "photo.png", stored_as(photo, row.orientation), row.orientation, **row.saved)
    row.write(folder / row.map, near)
    file = None if row.map.startswith("photo") else str(folder / row.map)
    choice = DepthChoice(**({"file": file, "refine": False} | row.choice))
    return open_with_depth(path, choice, **row.opened)


@pytest.mark.parametrize("name", ROWS)
def test_a_map_beside_is_read_scaled_and_named(tmp_path, regenerate_golden, name) -> None:
    row = ROWS[name]
    found, near = open_row(tmp_path, row), row.scene[1]
    grid = row.opened.get("grid", GridShape(9, 9))
    assert_disparity(found, usual_disparity(near, grid) if row.expected is None else row.expected(near), row.atol)
    if row.metres is not None:
        assert_metres(found, row.metres(near))
    assert_as_kept(found, tmp_path, "beside", name, regenerate_golden)


CAMERA_MAPS = {
    "millimetres": (lambda metres: np.where(HOLES, 0, 1000 * metres).astype(np.uint16), 1),
    "65535 is unknown": (lambda metres: np.where(HOLES, 65535, 1000 * metres).astype(np.uint16), 1),
    "65535 is unknown, in 32 bits": (lambda metres: np.where(HOLES, 65535, 1000 * metres).astype(np.int32), 1),
    "5000 a metre": (lambda metres: 5 * np.where(HOLES, 0, 1000 * metres).astype(np.uint16), 1),
    "7000 a metre": (lambda metres: np.where(HOLES, 0, 7000 * metres).astype(np.uint16), 7),
    "rotated bits": (lambda metres: rotated(np.where(HOLES, 0, 1500 * metres).astype(np.uint16)), 1.5),
    "millimetres of 32 bits, without holes": (lambda metres: (1000 * metres).astype(np.uint32), 1),
    "half floats": (lambda metres: np.where(HOLES, 0, metres).astype(np.float16), 1),
}
"""Numbers of a depth camera's map by metres, and the ratio of the distances that are read to the true ones."""


@pytest.mark.parametrize("scene", [drawn(), slope()], ids=["photo shows near end", "numbers show it"])
@pytest.mark.parametrize("kind", CAMERA_MAPS)
def test_maps_of_depth_cameras_are_distances_by_their_numbers(
    tmp_path, regenerate_golden, kind, scene, request
) -> None:
    numbers, ratio = CAMERA_MAPS[kind]
    photo, near = scene[0], scene[1] + np.float32(0.2)
    row = Row("photo_depth.npy", array(lambda near: numbers(1 / near)), scene=(photo, near))
    found = open_row(tmp_path, row)
    assert_metres(found, near / ratio)
    factor, offset = found.disparity.inverse_metres
    known = ~HOLES
    np.testing.assert_allclose((factor * found.disparity.values + offset)[known], (near / ratio)[known], atol=0.015)
    assert found.disparity.unknown is None or not found.disparity.unknown[known].any()
    assert_as_kept(found, tmp_path, "beside", request.node.callspec.id, regenerate_golden)


@pytest.mark.parametrize("orientation", [3, 6, 8])
def test_a_map_lies_like_the_stored_photo_or_is_turned_itself(tmp_path, regenerate_golden, orientation) -> None:
    stored = stored_as(spread(drawn()[1]), orientation)
    zeros = spread(drawn()[1])
    zeros[:2, :3] = 0
    writes: dict[str, Write] = {
        "upright.png": integers(),
        "stored.png": lambda path, _: save(path, stored),
        "own_exif.jpg": lambda path, _: save(path, np.repeat(stored[..., None], 3, 2), orientation),
        "zeros.png": lambda path, _: save(path, stored_as(zeros, orientation)),
    }
    for name, write in writes.items():
        found = open_row(tmp_path, Row(name, write, orientation=orientation))
        assert_disparity(found, usual_disparity(drawn()[1]))
        assert_as_kept(found, tmp_path, "beside", f"{name}, {orientation}", regenerate_golden)
    assert found.disparity.unknown is not None
    assert found.disparity.unknown[0, 0]
    ramp = np.tile(np.linspace(0, 4, HEIGHT, dtype=np.float32)[:, None], (1, WIDTH))
    found = open_row(tmp_path, Row("ramp.npy", array(lambda _: ramp), orientation=orientation))
    np.testing.assert_allclose(found.disparity.values, ramp, atol=1e-5, err_msg="in doubt a map is upright")


def test_maps_that_cannot_serve_are_refused_with_the_way_out(tmp_path) -> None:
    grey = spread(drawn()[1])
    squashed = Row("map.png", lambda path, _: save(path, cv2.resize(grey, (112, 112))))
    with pytest.raises(InputError, match=r"112x112 .* 240x160; crop or rotate it") as refused:
        open_row(tmp_path, squashed)
    assert remedy_of(refused.value) is Remedy.STRETCH
    with pytest.raises(InputError, match=r"picture\.jpg: is a colour picture; .*save it as grey"):
        open_row(tmp_path, Row("picture.jpg", lambda path, _: save(path, drawn()[0])))
    hues = np.dstack([grey, *[np.full_like(grey, 255)] * 2])
    with pytest.raises(InputError, match=r"circle of hues .*; save it as grey"):
        open_row(tmp_path, Row("hsv.png", lambda path, _: Image.fromarray(hues, "HSV").convert("RGB").save(path)))


SOFT = cv2.GaussianBlur(drawn()[1], (0, 0), 2.0)
REFINED: dict[str, tuple[Write, int]] = {
    "soft, half as large": (lambda path, _: save(path, as_bytes(SOFT)[::2, ::2]), 1),
    "soft": (lambda path, _: np.save(path, SOFT), 6),
    "grown, with holes": (
        lambda path, near: np.save(path, np.where(HOLES, np.nan, cv2.dilate(near, np.ones((7, 7), np.uint8)))), 1
    ),
    "a coarse jpeg": (lambda path, near: save(path, as_bytes(near)[::4, ::4], quality=60), 8),
}  # fmt: skip


def test_opened_maps_are_drawn_to_the_photos_edges(tmp_path, regenerate_golden) -> None:
    maps = []
    for name, (write, orientation) in REFINED.items():
        file = "map.npy" if name in ("soft", "grown, with holes") else "map.jpg" if "jpeg" in name else "map.png"
        found = open_row(tmp_path, Row(file, write, {"refine": True}, orientation=orientation))
        assert_as_kept(found, tmp_path, "beside", name, regenerate_golden)
        maps.append(unit(found.disparity.values)[::2, ::2])
    assert_sheet("opened", maps, (0, 1), 2, regenerate_golden, tmp_path)
