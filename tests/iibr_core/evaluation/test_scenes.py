from pathlib import Path

import cv2
import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.evaluation.evaluate import Options
from iibr_core.evaluation.scenes import find_scenes, in_front, read_scene, trial_input, trials_of
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.types import ImageSize, InputError, ViewOffset
from tests.iibr_core.known_scenes import FOREGROUND, HEIGHT, WALL, WIDTH, disparity_of_square, write_grid

UNREFINED = DepthChoice(refine=False)


def scene_of(folder: Path) -> MultiView:
    scene = read_scene(folder)
    assert scene is not None
    return scene


def offset_by_file(scene: MultiView) -> dict[str, ViewOffset]:
    """Viewpoints from the centre view's, by the stem of the file."""
    origin = scene.views[scene.centre].offset
    return {v.path.stem: ViewOffset(v.offset.t - origin.t, v.offset.s - origin.s) for v in scene.views}


def write_picture(path: Path, pixels: np.ndarray) -> None:
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


def turned_cameras(folder: Path) -> tuple[MultiView, Options]:
    """Return a wall at depth 10, seen by cameras that are turned and stand before and behind the plane, and its map."""
    focal = 60.0
    places = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.8), (-1.0, 0.0, -0.8))
    cameras = list(zip(places, (np.eye(3), rotation("y", 4), rotation("z", -5))))
    scene = scene_of(write_llff(folder / "fern", cameras, focal))
    assert offset_by_file(scene) == {"IMG_00": (0, 0), "IMG_01": (0, 1), "IMG_02": (0, -1)}
    np.save(folder / "wall.npy", np.full((HEIGHT, WIDTH), focal / 10.0, np.float32))
    return scene, Options(folder / "wall.npy")


def test_free_cameras_see_nothing_behind_them_or_far_beyond_their_range(tmp_path) -> None:
    camera = turned_cameras(tmp_path)[0].views[0].camera.resized(ImageSize(HEIGHT, WIDTH))
    least = 0.1 * 60 / camera.depth_range[1]
    found = in_front(camera, np.float32([[-1.0, 0.0, 6.0]]))
    np.testing.assert_allclose(found, [[least, least, 6.0]], rtol=1e-5)


def test_few_views_are_spread_and_hold_the_farthest(tmp_path) -> None:
    centre, corner = trials_of(scene_of(write_grid(tmp_path / "square")), "given", 3)
    assert len(centre.judged) == 3
    assert (-1.0, -1.0) in [centre.offset(index) for index in centre.judged]
    assert [corner.offset(index) for index in corner.judged] == [(-2.0, 0.0)]


def test_a_true_map_comes_alone_and_another_one_also_fitted(tmp_path) -> None:
    folder = write_grid(tmp_path / "scene")
    trial = trials_of(scene_of(folder), "given")[0]
    assert list(trial_input(trial, "given", UNREFINED, 10**6).maps) == ["true map"]
    np.save(tmp_path / "mine.npy", 3 * disparity_of_square() + 1)
    mine = trial_input(trial, tmp_path / "mine.npy", UNREFINED, 10**6)
    assert list(mine.maps) == ["given map", "given map, fitted"]
    assert mine.judge.source == "gt_disp_u01_v01.npy"
    assert np.abs(mine.maps["given map, fitted"].values - disparity_of_square()).max() < 0.2
    (folder / "gt_disp_u01_v01.npy").unlink()
    with pytest.raises(InputError, match="has no disparity map beside it"):
        trial_input(trials_of(scene_of(folder), "given")[0], "given", UNREFINED, 10**6)


def test_a_map_is_carried_to_the_corner(tmp_path) -> None:
    corner = trials_of(scene_of(write_grid(tmp_path / "square")), "given")[1]
    found = trial_input(corner, "given", UNREFINED, 10**6).judge
    assert found.source == "gt_disp_u01_v01.npy, carried over"
    wanted = np.full((HEIGHT, WIDTH), WALL, np.float32)
    top, left = round(HEIGHT / 3 - FOREGROUND), round(WIDTH / 3 + FOREGROUND)
    wanted[top : top + HEIGHT // 3, left : left + WIDTH // 3] = FOREGROUND
    np.testing.assert_allclose(found.values, wanted, atol=1e-5)


def test_the_view_with_a_map_nearest_to_the_centre_is_given(tmp_path) -> None:
    folder = write_grid(tmp_path / "square", 5)
    for name in ("u00_v00", "u03_v02"):
        np.save(folder / f"gt_disp_{name}.npy", disparity_of_square())
    (folder / "gt_disp_u02_v02.npy").unlink()
    for source, name in (("given", "v02 u03"), ("estimate", "v02 u02")):
        scene = scene_of(folder)
        centre, corner = trials_of(scene, source)
        assert scene.views[centre.given].name == name
        assert len(centre.judged) == 24
        assert (scene.views[corner.given].name, corner.offset(corner.judged[0])) == ("v04 u00", (-4, 0))


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda f: write_image(f / "views/v1_u1.exr", np.zeros((5, 5, 3), np.float32)), "same view"),
        (lambda f: (f / "images/IMG_01.png").unlink(), "3 poses for 2 pictures"),
        (lambda f: np.save(f / "poses_bounds.npy", np.zeros((3, 16))), "17 numbers"),
    ],
)
def test_a_damaged_scene_is_one_clear_line(tmp_path, damage, named) -> None:
    if named == "same view":
        write_grid(tmp_path / "scene")
    else:
        write_llff(tmp_path / "scene", [((float(k), 0.0, 0.0), np.eye(3)) for k in range(3)], 50.0)
    damage(tmp_path / "scene")
    with pytest.raises(InputError, match=rf"^[^\n]*{named}[^\n]*$"):
        list(find_scenes(tmp_path / "scene"))
    (tmp_path / "photo.png").touch()
    for path in (tmp_path / "gone", tmp_path / "photo.png"):
        with pytest.raises(InputError, match="HCI, Stanford"):
            list(find_scenes(path))
