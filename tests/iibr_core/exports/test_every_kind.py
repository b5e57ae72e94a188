"""Every kind of export, with its options, of a field and a photo that are hard in every way; read by other programs.

What is found is compared with `tests/golden/exports`; what is known in closed form, with `hard_scenes`.
"""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.beyond.optics import ApertureMask
from iibr_core.color import bytes_from_encoded, linear_from_srgb, srgb_from_linear
from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.cameras import cameras_of
from iibr_core.exports.kinds import ExportOptions, export_kind, export_path
from iibr_core.exports.source import ExportSource, open_for_export, write_export
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.formats.poses import read_poses
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core import hard_scenes as scenes
from tests.iibr_core.exports.facts import facts_of
from tests.iibr_core.facts import colors, differences, require_golden
from tests.iibr_core.formats.test_every_field import middlebury_pair, stanford

TILTED = {"aperture": 1.5, "tilt": (0.4, -0.3), "focus_range": 0.2}
KEYS = "\ufeff# s t focus aperture\n-2 -1 1 0\n1, 1, 0.5, 0\n\n0 0 1 0"
"""A camera path whose keys are views of the field, for every second of 6 frames."""


DOT = ApertureMask("dot", 1, 1, b"\xff")


@dataclass(frozen=True)
class Row:
    """An export. name: of the file. lens, options: choices. levels: largest difference of colours, of 0..255."""

    scene: str
    kind: str
    name: str
    lens: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)
    levels: int = 2


ROWS = [
    Row("field", "quilt", "a.png"),
    Row("photo", "quilt", "b.jpg", {"f_number": 4.0, "focus": 0.5}),
    Row("field", "sbs", "a.png", {"focus": 1.5, "aperture": 0.0}, {"eyes": 2.0, "size": ScreenSize(60, 30)}),
    Row("photo", "sbs", "b.jpg", {"eye": ViewOffset(-1.0, 0.0)}),
    Row("field", "half-sbs", "a_SBS.webp", {}, {"eyes": 1.0}, 4),
    Row("photo", "half-sbs", "b_half_SBS.tif"),
    Row("field", "over-under", "a.avif", {}, {"size": ScreenSize(30, 50)}, 4),
    Row("field", "half-over-under", "a.tif", {"eye": ViewOffset(0.5, 0.0)}),
    Row("field", "cross-eyed", "a.png"),
    Row("photo", "anaglyph", "b.jpg", {"focus_at": (70.0, 30.0), "aperture": 0.0}, {}, 4),
    Row("field", "spatial-photo", "a.heic", {"focus": -0.4, "aperture": 0.0}, {}, 5),
    Row("photo", "spatial-photo", "b.heic", {}, {"size": ScreenSize(96, 64), "eyes": 2.0}, 5),
    Row("field", "mp4", "a.mp4", {"focus": 0.3, "aperture": 0.5}, {"keys": KEYS, "frames": 6, "rate": 12.0}, 5),
    Row("photo", "webm", "b.webm", {}, {"motion": "eight", "frames": 8, "rate": 7.5, "size": ScreenSize(64, 32)}, 5),
    Row("field", "gif", "a.gif", {"aperture": 3.0}, {"motion": "rack", "rack": (9.0, -1.5), "frames": 5}, 8),
    Row("photo", "gif", "b.gif", {}, {"motion": "circle", "frames": 12, "rate": 100.0}, 8),
    Row("field", "webp", "a.webp", {"aperture": 1.0}, {"motion": "focus", "frames": 4, "rate": 9.0}, 5),
    Row("photo", "webp", "b.webp", {"focus": 0.4}, {"motion": "aperture", "frames": 24, "rate": 240.0}, 5),
    Row("photo", "webp", "c.webp", {}, {"motion": "swing", "frames": 4, "rate": 4.0, "size": ScreenSize(50, 50)}, 5),
    Row("field", "focal-stack", "a", {**TILTED, "eye": ViewOffset(-0.5, 1.0)}, {"frames": 2, "bits": 16}),
    Row("photo", "focal-stack", "b", {"blades": 5, "aperture": 3.0, "highlights": 2.0}, {"frames": 2}),
    Row("field", "rgbd", "a.png"),
    Row("photo", "rgbd", "b.webp", {}, {"layout": "left"}, 4),
    Row("photo", "rgbd", "b.tif", {}, {"layout": "below"}),
    Row("field", "epi", "a.png", {}, {"row": 10}),
    Row("photo", "epi", "b.png"),
    *(Row("field", "disparity", f"a.{ending}") for ending in ("pfm", "exr", "png")),
    *(Row("photo", "disparity", f"b.{ending}") for ending in ("npy", "tif")),
    *(Row("field", "depth", f"a.{ending}") for ending in ("npy", "exr")),
    *(Row("photo", "depth", f"b.{ending}") for ending in ("pfm", "png", "tif")),
    Row("field", "blur", "a.exr", {**TILTED, "focus": 0.5}),
    Row("photo", "blur", "b.exr", {"aperture": 2.0, "focus": 0.3, "tilt": (0.0, 0.5)}),
    Row("field", "depth-mask", "a.png", {"focus": 1.8, "focus_range": 0.3, "tilt": (0.5, 0.2)}),
    Row("photo", "depth-mask", "b.tif", {"focus_at": (10.0, 60.0)}, {"soft": 2.5}),
    Row("field", "matte", "a.tif", {}, {"at": (30.0, 10.0), "tolerance": 40.0}),
    Row("photo", "matte", "b.png", {}, {"at": (66.5, 20.0), "tolerance": 0.5}),
    *(Row(scene, "splats", f"{scene}.{ending}") for scene in ("field", "photo") for ending in ("ply", "spz")),
    *(Row(scene, "point-cloud", f"{scene}.ply") for scene in ("field", "photo")),
    *(Row(scene, "mesh", f"{scene}.glb", {}, {}, 4) for scene in ("field", "photo")),
    Row("photo", "llff", "b", {}, {"grid": GridShape(2, 3)}),
    *(Row(scene, kind, scene) for scene in ("field", "photo") for kind in ("nerfstudio", "colmap", "hci")),
    Row("field", "eslf", "a_eslf.png"),
    Row("photo", "eslf", "b_eslf.png", {}, {"grid": GridShape(3, 3)}),
    Row("field", "npz", "a.npz"),
    Row("photo", "npz", "b.npz", {}, {"grid": GridShape(3, 2)}),
    Row("field", "web", "a.html", {**TILTED, "focus": 0.4, "mask": DOT}, {"budget": 400_000}, 8),
    Row("photo", "web", "c.html", {"focus": 1.0, "ring": 0.3, "eye": ViewOffset(-1.0, 1.0)}, {"target": "headset"}, 8),
    Row("photo", "web", "b.html", {"f_number": 2.8, "blades": 7, "rotation": 20.0, "highlights": 1.0},
        {"credit": True}, 8),
]  # fmt: skip


def export(hard: dict[str, ExportSource], row: Row, folder: Path) -> tuple[Path, str | None]:
    """Write an export; return its path and what is said of it."""
    source, options = hard[row.scene], dict(row.options)
    if "keys" in options:
        (folder / "keys.txt").write_text(options["keys"])
        options["keys"] = folder / "keys.txt"
    source = replace(source, optics=LensChoice(**row.lens).optics_on(source.scene, source.centre.disparity))
    kind, chosen = export_kind(row.kind), ExportOptions(**options)
    path = export_path(kind, folder / row.name, source.scene, chosen)
    return path, write_export(kind, path, source, chosen)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.kind}-{row.name}")
def test_other_programs_find_what_they_found_before(hard, tmp_path, row, regenerate_golden) -> None:
    path, message = export(hard, row, tmp_path)
    message = message and re.sub(r"[\d.]+ MB", "some MB", message)
    facts = facts_of(path) | {"message": message}
    require_golden(facts, "exports", f"{row.kind}-{row.name}", row.levels, regenerate_golden)


def seen(row: int, column: int) -> np.ndarray:
    """Return a view of the field as bytes."""
    return bytes_from_encoded(scenes.field_view(row, column))


def test_pictures_at_views_of_the_field_are_these_views(hard, tmp_path) -> None:
    """The right eye stands at the last column, the first tile of a quilt at the bottom left is the first column."""
    files = {row.name: export(hard, row, tmp_path)[0] for row in ROWS if row.name in ("a.gif", "a.mp4")}
    found = {kind: export(hard, Row("field", kind, f"{kind}.png"), tmp_path)[0] for kind in PICTURES}
    pixels = {kind: np.asarray(Image.open(path).convert("RGB")) for kind, path in found.items()}
    left, right = seen(1, 0), seen(1, 3)
    assert off(pixels["cross-eyed"], np.hstack([right, left])) <= 1
    assert off(pixels["sbs"], np.hstack([left, right])) <= 1
    in_focus = np.asarray(Image.open(export(hard, FOCUSED, tmp_path)[0]))
    assert off(in_focus, np.hstack([left[:, 8:], right[:, 2:42]])) <= 1, "the square stays in place"
    assert off(pixels["over-under"], np.vstack([left, right])) <= 1
    assert off(pixels["anaglyph"], dubois(left, right)) <= 2
    assert max(off(pixels["quilt"][-32:, :48], left), off(pixels["quilt"][:32, -48:], right)) <= 1
    assert off(pixels["epi"], np.stack([seen(1, column)[16] for column in range(4)])) <= 1
    lenslets = np.asarray(Image.open(export(hard, Row("field", "eslf", "a_eslf.png"), tmp_path)[0]))
    assert all(off(lenslets[v::3, u::4], seen(v, u)) <= 1 for v, u in np.ndindex(*scenes.GRID))
    with np.load(export(hard, Row("field", "npz", "a.npz"), tmp_path)[0]) as arrays:
        assert off(arrays["views"], np.array([[seen(v, u) for u in range(4)] for v in range(3)])) <= 1
        assert arrays["disparity"][2, 3][7:19, 26:38] == pytest.approx(scenes.NEAR_PX)
    frames = facts_of(files["a.mp4"])["frames"][::2]
    assert not list(differences(frames, [colors(seen(*at)) for at in ((0, 0), (2, 3), (1, 2))], 16))


FOCUSED = Row("field", "sbs", "focused.png", {"focus": scenes.NEAR_PX, "aperture": 0.0})
PICTURES = "cross-eyed", "sbs", "over-under", "anaglyph", "quilt", "epi"


def off(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.abs(one.astype(float) - other).max())


def dubois(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the anaglyph by the published matrices, each eye's light cut off before both are added."""
    left_from_rgb = [[0.437, 0.449, 0.164], [-0.062, -0.062, -0.024], [-0.048, -0.050, -0.017]]
    right_from_rgb = [[-0.011, -0.032, -0.007], [0.377, 0.761, 0.009], [-0.026, -0.093, 1.234]]
    parts = [
        linear_from_srgb(eye / 255) @ np.transpose(m) for eye, m in ((left, left_from_rgb), (right, right_from_rgb))
    ]
    return 255 * srgb_from_linear(np.clip(sum(np.clip(part, 0, 1) for part in parts), 0, 1))


def test_cameras_state_the_metres_and_steps_of_the_scenes(hard, tmp_path) -> None:
    """Views of the field are cropped so that what is infinitely far stays in place; views of the photo are moved."""
    step = (scenes.NEAR_PX - scenes.INFINITY_PX) / scenes.FIELD_FOCAL_PX
    for kind in ("nerfstudio", "colmap"):
        folder = export(hard, Row("field", kind, kind), tmp_path)[0]
        for v, u in np.ndindex(*scenes.GRID):
            t, s = scenes.ROW_STEP * (v - 1), u - 2
            top, left = round(2 - scenes.INFINITY_PX * t), round(6 - scenes.INFINITY_PX * s)
            cropped = np.asarray(Image.open(folder / "images" / f"v{v:02d}_u{u:02d}.png"))
            assert off(cropped, seen(v, u)[top : top + 28, left : left + 36]) <= 1
            camera = read_poses(folder)[4 * v + u]
            assert camera.world_from_camera.T @ camera.position == pytest.approx((step * s, step * t, 0))
            assert np.add(camera.centre_px, (left + 0.5, top + 0.5)) == pytest.approx((24 + 3 * s, 16 + 3 * t))
    x, y, z, *rgb = next(line.split()[1:7] for line in points_of(folder) if line.split()[3] == "1")
    column, row = (round(60 * float(at) / float(z) + half - 0.5) for at, half in ((x, 24), (y, 16)))
    assert off(seen(1, 2)[row, column], np.array(rgb, float)) <= 1
    photo = hard["photo"].scene
    low, high = photo.disparity_range_px
    step_m = (high - low) / (1 / scenes.NEAR_M - 1 / scenes.FAR_M) / scenes.PHOTO_FOCAL_PX
    parameters = facts_of(export(hard, Row("photo", "hci", "hci"), tmp_path)[0])["parameters.cfg"]
    assert parameters["baseline_mm"] == pytest.approx(1000 * step_m)
    assert parameters["focal_length_mm"] == pytest.approx(scenes.PHOTO_FOCAL_PX * 36 / 48)
    assert high == pytest.approx(
        step_m * scenes.PHOTO_FOCAL_PX * (1 / scenes.NEAR_M - 1 / parameters["focus_distance_m"])
    )
    folder = export(hard, Row("photo", "nerfstudio", "ns"), tmp_path)[0]
    first, second = (camera.position for camera in read_poses(folder)[:2])
    assert scenes.NEAR_M * (second - first) == pytest.approx((step_m, 0, 0)), "one unit is the distance of the nearest"
    depth = read_pfm(export(hard, Row("photo", "depth", "a.pfm"), tmp_path)[0])
    assert depth == pytest.approx(scenes.flat_map(scenes.NEAR_M, scenes.FAR_M), rel=1e-4)


@pytest.mark.parametrize("write", [middlebury_pair, stanford(-30.0, 30.0)], ids=["pair", "off its grid"])
def test_cameras_count_from_the_view_whose_points_are_written(tmp_path, write) -> None:
    """It is the middle one of an even grid, wherever the cameras stand, and the right one of a pair."""
    folder, given = tmp_path / "field", tmp_path / "given.npy"
    folder.mkdir()
    write(folder)
    np.save(given, np.full((24, 32), 2.0, np.float32))
    source = Source(str(folder), DepthChoice(file=str(given)))
    kind = export_kind("colmap")
    opened = open_for_export(kind, ExportOptions(), source, 1.0, LensChoice(), lambda scene: None, None)
    assert cameras_of(opened).offset(*opened.scene.grid.centre) == (0, 0)
    assert cameras_of(opened).offset(0, 0).s == pytest.approx(-opened.scene.grid.centre[1], abs=0.02)


def points_of(folder: Path) -> list[str]:
    return (folder / "sparse" / "0" / "points3D.txt").read_text().splitlines()
