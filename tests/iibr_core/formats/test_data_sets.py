"""Stanford archive, Middlebury and LLFF on small folders: viewpoints, maps, units, and honest notes."""

from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.types import GridShape, ImageSize, ViewOffset
from tests.iibr_core.evaluation.test_scenes import offset_by_file, scene_of, write_picture
from tests.iibr_core.known_scenes import HEIGHT, WIDTH, write_numbered


def write_archive(folder: Path, positions: dict[tuple[int, int], tuple[float, float]]) -> MultiView:
    """Write and read a Stanford folder. positions: (y, x) by (row, column)."""
    names = {
        f"out_{row:02d}_{column:02d}_{y:.6f}_{x:.6f}_.png": ViewOffset(0, 0)
        for (row, column), (y, x) in positions.items()
    }
    write_numbered(folder, names)
    return scene_of(folder)


def offsets_by_index(scene: MultiView) -> dict[tuple[int, int], np.ndarray]:
    """Viewpoints (t, s) from that of row 0 and column 0, by row and column in the names."""
    by_index = {tuple(map(int, view.path.stem.split("_")[1:3])): np.array(view.offset) for view in scene.views}
    return {index: offset - by_index[0, 0] for index, offset in by_index.items()}


@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_stanford_viewpoints_are_the_cameras_positions(tmp_path: Path, jitter: float) -> None:
    """Rows are counted upwards and columns leftwards; positions are in millimetres, slightly off the grid."""
    rng = np.random.default_rng(3)
    steps = {at: -np.array(at) + rng.uniform(-jitter, jitter, 2) for at in np.ndindex(5, 4)}
    scene = write_archive(tmp_path / "rectified", {at: (100 + 30 * t, 30 * s) for at, (t, s) in steps.items()})
    scene = scene_of(tmp_path)
    assert (scene.layout, scene.grid) == ("Stanford archive, 4x5", (5, 4))
    for at, offset in offsets_by_index(scene).items():
        np.testing.assert_allclose(offset, steps[at] - steps[0, 0], atol=2 * jitter + 1e-6)
    assert {view.path.stem[:9]: view.place for view in scene.views}["out_04_03"] == (0, 0)
    assert ("stand up to" in scene.notes[0]) == (jitter > 0)


@pytest.mark.parametrize(("rows", "columns", "step"), [(3, 3, 20.0), (3, 1, 45.0), (1, 3, 20.0)])
def test_a_step_of_stanford_is_the_spacing_of_columns_else_of_rows(
    tmp_path: Path, rows: int, columns: int, step: float
) -> None:
    """Rows may stand farther apart."""
    positions = {at: (300 + 45.0 * at[0], -700 + 20.0 * at[1]) for at in np.ndindex(rows, columns)}
    scene = write_archive(tmp_path, positions)
    assert scene.grid == GridShape(rows, columns)
    for at, offset in offsets_by_index(scene).items():
        np.testing.assert_allclose(offset, np.subtract(positions[at], positions[0, 0]) / step)
    assert scene.notes == ("Viewpoints from the names.",)


def test_middlebury_pair_from_the_left(tmp_path: Path) -> None:
    folder = write_numbered(tmp_path / "pair", {f"im{n}.png": ViewOffset(0, n) for n in (0, 1)}, (HEIGHT, WIDTH))
    disparity = np.full((HEIGHT, WIDTH), 7.5, np.float32)
    disparity[0, 0] = np.inf
    write_pfm(folder / "disp0.pfm", disparity)
    scene = scene_of(folder)
    assert (scene.layout, scene.centre) == ("Middlebury pair", 0)
    assert offset_by_file(scene) == {"im0": (0, 0), "im1": (0, 1)}
    known = read_disparity(scene.disparity[0].path, ImageSize(HEIGHT, WIDTH), scene.disparity[0].scale)
    assert known.values[1, 1] == 7.5
    assert np.isfinite(known.values).all()


@pytest.mark.parametrize(
    ("kind", "count", "truths", "extension", "width", "factor"),
    [
        ("im", 9, (2, 6), ".png", 450, 4.0),  # 2003, quarter size
        ("im", 9, (2, 6), ".ppm", 434, 8.0),  # 2001
        ("view", 7, (1, 5), ".png", 463, 3.0),  # 2005, third size
    ],
)
def test_middlebury_rows_store_four_steps_times_a_factor(
    tmp_path: Path, kind: str, count: int, truths: tuple[int, int], extension: str, width: int, factor: float
) -> None:
    for n in range(count):
        write_picture(tmp_path / f"{kind}{n}{extension}", np.zeros((4, width, 3), np.uint8))
    for n in truths:
        stored = np.full((4, width), 120, np.uint8)
        stored[0, 0] = 0  # unknown
        write_picture(tmp_path / f"disp{n}.png", stored)
    scene = scene_of(tmp_path)
    assert [view.offset.s for view in scene.views] == list(range(count))
    assert list(scene.disparity) == list(truths)
    for known in scene.disparity.values():
        values = read_disparity(known.path, ImageSize(4, width), known.scale).values
        np.testing.assert_allclose(values, 120 / factor / 4, rtol=1e-5)


def test_llff_counts_in_steps_between_neighbours_across_the_viewing_direction(tmp_path: Path) -> None:
    """Cameras are half a unit apart and some nearer; bounds are depths, so disparity is focal length x step / depth."""
    write_numbered(tmp_path / "images", {f"IMG_{n}.png": ViewOffset(0, n) for n in range(3)}, (HEIGHT, WIDTH))
    down, right, back = np.eye(3)[[1, 0, 2]] * [[1], [1], [-1]]
    places = [(-0.5, 0.0, 0.3), (0.0, 0.0, 0.0), (0.0, 0.5, 0.1)]
    poses = [np.column_stack([down, right, back, place, [HEIGHT, WIDTH, 50]]).ravel() for place in places]
    np.save(tmp_path / "poses_bounds.npy", np.array([[*pose, 5.0, 40.0] for pose in poses]))
    scene = open_light_field(tmp_path)
    np.testing.assert_allclose([view.offset for view in scene.views], [(0, -1), (0, 0), (1, 0)], atol=1e-12)
    assert scene.range_px == pytest.approx((50 * 0.5 / 40, 50 * 0.5 / 5))
    assert scene.focal_px == 50
    assert "up to 0.6 view steps before or behind" in scene.notes[0]
