"""Readers of data sets on small folders: viewpoints, maps, and one clear line for what is damaged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from iibr_core.evaluation.evaluate import Options, evaluate
from iibr_core.evaluation.scenes import (
    find_scenes,
    read_scene,
    read_straight_view,
    undo_rotation,
)
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView, nearest_view
from iibr_core.types import InputError, ViewOffset
from tests.iibr_core.known_scenes import (
    HEIGHT,
    WIDTH,
    view_of_wall,
    write_grid,
    write_hci,
    write_numbered,
)


def scene_of(folder: Path) -> MultiView:
    scene = read_scene(folder)
    assert scene is not None
    return scene


def offset_by_file(scene: MultiView) -> dict[str, ViewOffset]:
    """Viewpoints from the centre view's, by the stem of the file."""
    origin = scene.views[scene.centre].offset
    return {v.path.stem: ViewOffset(v.offset.t - origin.t, v.offset.s - origin.s) for v in scene.views}


def write_picture(path: Path, pixels: np.ndarray) -> None:
    import cv2

    assert cv2.imwrite(str(path), pixels)


def rotation(axis: str, degrees: float) -> np.ndarray:
    """World-to-camera rotation for x right, y down, z forward."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array({"y": [[c, 0, s], [0, 1, 0], [-s, 0, c]], "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis])


def write_llff(folder: Path, cameras: list[tuple[tuple[float, float, float], np.ndarray]], focal: float) -> Path:
    """Pictures of a wall at depth 10, as these cameras (position, world-to-camera) see it."""
    folder.mkdir()
    (folder / "images").mkdir()
    rows = []
    for k, (position, camera) in enumerate(cameras):
        write_image(folder / "images" / f"IMG_{k:02d}.png", seen_wall(np.array(position), camera, focal))
        right, down, forward = camera
        pose = np.column_stack([down, right, -forward, position, [HEIGHT, WIDTH, focal]])
        rows.append(np.concatenate([pose.ravel(), [8.0, 40.0]]))
    np.save(folder / "poses_bounds.npy", np.array(rows))
    return folder


def seen_wall(position: np.ndarray, camera: np.ndarray, focal: float, depth: float = 10.0) -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(x - (WIDTH - 1) / 2) / focal, (y - (HEIGHT - 1) / 2) / focal, np.ones_like(x)], -1) @ camera
    at = position + rays * ((depth - position[2]) / rays[..., 2])[..., None]
    waves = [np.sin(2.1 * at[..., 0] + k) * np.cos(1.7 * at[..., 1] - 2 * k) for k in range(3)]
    return (0.5 + 0.3 * np.stack(waves, -1)).astype(np.float32)


def test_llff_viewpoints_and_turned_cameras(tmp_path: Path) -> None:
    """Cameras on a plane: viewpoints in mean steps, pictures turned back as cameras that look the same way see them."""
    straight, focal = np.eye(3), 60.0
    places = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0)]
    turns = [straight, rotation("y", 5), rotation("z", -4), straight]
    cameras = [((x, y, 0.0), turn) for (x, y), turn in zip(places, turns)]
    scene = scene_of(write_llff(tmp_path / "fern", cameras, focal))
    assert scene.centre == 0
    assert offset_by_file(scene) == {f"IMG_{k:02d}": (y, x) for k, (x, y) in enumerate(places)}
    assert scene.range_px == pytest.approx((focal / 40, focal / 8))
    for k, (x, y) in enumerate(places):
        pixels, known = read_straight_view(scene.views[k], 10**6)
        wanted = seen_wall(np.array([x, y, 0.0]), straight, focal)
        assert known.mean() > 0.7
        assert np.abs(pixels - wanted)[known].max() < 0.02


def test_llff_in_a_turned_world_gives_the_same(tmp_path: Path) -> None:
    world = rotation("y", 70) @ rotation("z", 20)
    places = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.5)]
    plain = scene_of(write_llff(tmp_path / "a", [(p, np.eye(3)) for p in places], 50.0))
    turned = [(tuple(world.T @ p), world) for p in np.array(places)]
    other = scene_of(write_llff(tmp_path / "b", turned, 50.0))
    np.testing.assert_allclose(
        np.array([v.offset for v in plain.views]), np.array([v.offset for v in other.views]), atol=1e-9
    )
    for one, two in zip(plain.views, other.views):
        assert one.camera is not None
        assert two.camera is not None
        np.testing.assert_allclose(one.camera.world_from_camera, two.camera.world_from_camera, atol=1e-6)
        np.testing.assert_allclose(one.camera.position, two.camera.position, atol=1e-6)
    assert "0.2 view steps before or behind" in plain.notes[0]


def test_llff_views_are_made_for_their_cameras_as_they_are(tmp_path: Path) -> None:
    """A wall at 10, seen by cameras that are turned and stand before and behind the plane."""
    focal = 60.0
    cameras = [
        ((0.0, 0.0, 0.0), np.eye(3)),
        ((1.0, 0.0, 0.8), rotation("y", 4)),
        ((-1.0, 0.0, -0.8), rotation("z", -5)),
    ]
    folder = write_llff(tmp_path / "fern", cameras, focal)
    np.save(tmp_path / "wall.npy", np.full((HEIGHT, WIDTH), focal / 10.0, np.float32))
    (result,) = evaluate(scene_of(folder), Options(tmp_path / "wall.npy"))
    rows = {row.method: row.mean for row in result.rows}
    assert list(rows) == ["identity", "reference warp", "iibr"]
    assert rows["identity"].full_db < 25 < 35 < rows["iibr"].visible_db
    assert result.consistency == {}


def test_turning_back_by_nothing_changes_nothing() -> None:
    pixels = view_of_wall(ViewOffset(0.0, 0.0))
    same, known = undo_rotation(pixels, np.eye(3))
    assert known.all()
    np.testing.assert_allclose(same, pixels, atol=1e-5)


def test_a_turned_view_made_smaller_is_the_small_turned_view(tmp_path: Path) -> None:
    cameras = [((0.0, 0.0, 0.0), np.eye(3)), ((1.0, 0.0, 0.0), rotation("y", 4)), ((-1.0, 0, 0), np.eye(3))]
    scene = scene_of(write_llff(tmp_path / "fern", cameras, 60.0))
    small, known = read_straight_view(scene.views[1], HEIGHT * WIDTH // 4)
    full = seen_wall(np.array([1.0, 0, 0]), np.eye(3), 60.0)
    wanted = full.reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean(axis=(1, 3))
    assert small.shape == wanted.shape
    assert np.abs(small - wanted)[known].max() < 0.03


def test_folders_of_scenes_are_looked_through(tmp_path: Path) -> None:
    write_grid(tmp_path / "b")
    write_hci(tmp_path / "a")
    (tmp_path / "other").mkdir()
    assert [scene.name for scene in find_scenes(tmp_path)] == ["a", "b"]


def test_the_centre_of_an_even_grid_is_farther_down_and_right() -> None:
    views = tuple(
        KnownView("", ViewOffset(t, s), PictureSource(Path())) for t in (0.0, 1.0) for s in (0.0, 1.0, 2.0, 3.0)
    )
    assert views[nearest_view(views, ViewOffset(0.5, 1.5))].offset == (1.0, 2.0)


Damage = Callable[[Path], object]


def rows_of(folder: Path) -> np.ndarray:
    return np.load(folder / "poses_bounds.npy")


def spoil(folder: Path, row: int, column: int, value: float) -> None:
    rows = rows_of(folder)
    rows[row, column] = value
    np.save(folder / "poses_bounds.npy", rows)


GRID_DAMAGE: list[tuple[Damage, str]] = [
    (lambda f: (f / "views/v01_u02.png").unlink(), r"v01_u02\.png: this view is missing"),
    (lambda f: (f / "views/v01_u02.png").rename(f / "views/v01_u03.png"), "missing"),
    (lambda f: write_image(f / "views/v02_u02.png", np.zeros((5, 5, 3), np.float32)), "v02_u02.png"),
    (lambda f: (f / "views/v02_u02.png").write_bytes(b"\x89PNG\r\n\x1a\n"), "v02_u02.png"),
    (lambda f: write_image(f / "views/v1_u1.exr", np.zeros((5, 5, 3), np.float32)), "same view"),
]
LLFF_DAMAGE: list[tuple[Damage, str]] = [
    (lambda f: (f / "images/IMG_01.png").unlink(), "3 poses for 2 pictures"),
    (lambda f: (f / "poses_bounds.npy").write_bytes(b"no array"), "poses_bounds.npy"),
    (lambda f: np.save(f / "poses_bounds.npy", rows_of(f)[:, :16]), "17 numbers"),
    (lambda f: np.save(f / "poses_bounds.npy", np.zeros((3, 17), object), allow_pickle=True), "poses_bounds.npy"),
    (lambda f: spoil(f, 0, 0, np.nan), "NaN"),
    (lambda f: spoil(f, 1, 0, 3.0), "rotation"),
    (lambda f: spoil(f, 1, 4, 0.0), "pixels"),
    (lambda f: spoil(f, 2, 15, -1.0), "depths"),
]


@pytest.mark.parametrize(("damage", "named"), GRID_DAMAGE)
def test_a_damaged_grid_is_one_clear_line(tmp_path: Path, damage: Damage, named: str) -> None:
    folder = write_grid(tmp_path / "scene")
    damage(folder)
    with pytest.raises(InputError, match=named) as caught:
        list(find_scenes(folder))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("damage", "named"), LLFF_DAMAGE)
def test_damaged_poses_are_one_clear_line(tmp_path: Path, damage: Damage, named: str) -> None:
    folder = write_llff(tmp_path / "fern", [((float(k), 0.0, 0.0), np.eye(3)) for k in range(3)], 50.0)
    damage(folder)
    with pytest.raises(InputError, match=named) as caught:
        list(find_scenes(folder))
    assert "\n" not in str(caught.value)


def test_damaged_parameters_and_gaps_of_hci_are_told(tmp_path: Path) -> None:
    folder = write_hci(tmp_path / "dino")
    (folder / "parameters.cfg").write_text("[extrinsics]\nnum_cams_x = 4\nnum_cams_y = 3\n")
    with pytest.raises(InputError, match=r"input_Cam009\.png: this view is missing \(3 of 3x4"):
        read_scene(folder)
    (folder / "parameters.cfg").write_text("[extrinsics]\nnum_cams_x = 4\nnum_cams_y = 2\n")
    with pytest.raises(InputError, match=r"9 views do not fit a grid of 2x4"):
        read_scene(folder)
    (folder / "parameters.cfg").write_text("num_cams_x = many")
    with pytest.raises(InputError, match=r"parameters\.cfg"):
        read_scene(folder)
    (folder / "parameters.cfg").unlink()
    (folder / "input_Cam004.png").unlink()
    with pytest.raises(InputError, match=r"input_Cam004\.png: this view is missing \(1 of 9"):
        read_scene(folder)


def test_what_is_no_data_set_is_told(tmp_path: Path) -> None:
    (tmp_path / "photo.png").touch()
    for path in (tmp_path, tmp_path / "gone", tmp_path / "photo.png"):
        with pytest.raises(InputError, match="HCI, Stanford"):
            list(find_scenes(path))


def test_a_single_view_cannot_be_compared(tmp_path: Path) -> None:
    write_numbered(tmp_path / "one", {"out_00_00_1.0_2.0.png": ViewOffset(0.0, 0.0)})
    with pytest.raises(InputError, match="only view"):
        read_scene(tmp_path / "one")
