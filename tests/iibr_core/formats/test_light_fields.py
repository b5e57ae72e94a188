import configparser
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import disparity_range, read_views
from iibr_core.formats.light_fields.write import WRITERS, FieldScale, write_light_field
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import GridShape, InputError, ViewUpdate
from tests.iibr_core import known_scenes as known


def test_the_range_is_stated_or_that_of_the_map_nearest_to_the_centre(tmp_path) -> None:
    folder = known.write_grid(tmp_path / "scene", 5)
    assert disparity_range(open_light_field(folder)) == (0.5, 2.0)
    (folder / "gt_disp_u02_v02.npy").unlink()
    assert disparity_range(open_light_field(folder)) is None
    np.save(folder / "gt_disp_u00_v00.npy", 2 * known.disparity_of_square())
    np.save(folder / "gt_disp_u03_v02.npy", 3 * known.disparity_of_square())
    assert disparity_range(open_light_field(folder)) == (1.5, 6.0)
    (folder / "parameters.cfg").write_text("[meta]\ndisp_min = -1\ndisp_max = 7\n")
    assert disparity_range(open_light_field(folder)) == (-1, 7)


GRID = GridShape(3, 5)
HEIGHT, WIDTH = 6, 9
NAMES = {"hci": "field", "eslf": "field_eslf.png"}


def make_views(grid: GridShape = GRID, dtype: Any = np.uint8) -> list[ViewUpdate]:
    rng = np.random.default_rng(5)
    views = []
    for row, column in np.ndindex(*grid):
        colors = rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
        colors = (colors / 64).astype(dtype) if dtype == np.float16 else colors
        views.append(ViewUpdate(row, column, colors, rng.uniform(-2, 3, (HEIGHT, WIDTH)).astype(np.float32)))
    return [views[i] for i in rng.permutation(len(views))]


def write(folder, views, layout="hci", grid=GRID, with_disparity=True):
    path = folder / NAMES[layout]
    write_light_field(path, layout, grid, views, 12.5, "a\n scene", with_disparity)
    return path


@pytest.mark.parametrize("grid", [GRID, GridShape(1, 1), GridShape(1, 7)])
@pytest.mark.parametrize("dtype", [np.uint8, np.float16])
def test_hci_round_trip(tmp_path, grid, dtype) -> None:
    views = make_views(grid, dtype)
    scene = open_light_field(write(tmp_path, views, grid=grid))
    assert (scene.grid, read_views(scene)[0], scene.name) == (grid, (HEIGHT, WIDTH), "field")
    assert scene.focal_px == pytest.approx(12.5)
    assert scene.is_hdr == (dtype == np.float16)
    assert scene.range_px == (
        min(view.disparity.min() for view in views if view.disparity is not None),
        max(view.disparity.max() for view in views if view.disparity is not None),
    )
    numbered = {name for i in range(len(views)) for name in (f"input_Cam{i:03d}.png", f"disp_Cam{i:03d}.pfm")}
    pictures = {name.replace("png", "exr") if dtype == np.float16 else name for name in numbered}
    assert {path.name for path in scene.place.iterdir()} == {*pictures, "gt_disp_lowres.pfm", "parameters.cfg"}
    centre = next(view for view in views if (view.row, view.column) == grid.centre)
    np.testing.assert_array_equal(read_pfm(scene.place / "gt_disp_lowres.pfm"), centre.disparity)
    assert "scene = a scene" in (scene.place / "parameters.cfg").read_text()
    by_place = {(view.row, view.column): view for view in read_views(scene)[1]}
    assert len(by_place) == len(views)
    for view in views:
        read = by_place[view.row, view.column]
        assert read.colors.dtype == dtype
        tolerance = {"rtol": 4e-3, "atol": 1e-3} if dtype == np.float16 else {"atol": 0}
        np.testing.assert_allclose(read.colors.astype(float), view.colors.astype(float), **tolerance)
        np.testing.assert_array_equal(read.disparity, view.disparity)


def benchmark_depth(folder: Path, disparity: float) -> float:
    """Return the distance in mm by the formula of the benchmark's evaluation toolkit."""
    parser = configparser.ConfigParser()
    parser.read(folder / "parameters.cfg")
    lens, cameras = parser["intrinsics"], parser["extrinsics"]
    pixels = max(int(lens[f"image_resolution_{axis}_px"]) for axis in "xy")
    beta = float(cameras["baseline_mm"]) * float(lens["focal_length_mm"]) * pixels
    focus_mm = 1000 * float(cameras["focus_distance_m"])
    return beta * focus_mm / (disparity * focus_mm * float(lens["sensor_size_mm"]) + beta)


@pytest.mark.parametrize(
    ("scale", "infinity", "step_mm"),
    [
        (FieldScale(-6.0), -6.0, 1.0),
        (FieldScale(-2.5, None, 40.0), -2.5, 40.0),
        (FieldScale(0.0, (1.0, 4.0)), -1e-4, 1.0),
        (FieldScale(), -2.1, 1.0),
        (FieldScale(7.0), -2.1, 1.0),
    ],
)
def test_the_benchmark_computes_the_depths_of_a_field(tmp_path, scale, infinity, step_mm) -> None:
    """A guess of infinity puts it beyond the least disparity; one among the disparities is none."""
    views = [ViewUpdate(0, 0, view.colors, np.float32([[-1.9, 1.9]])) for view in make_views(GridShape(1, 1))]
    for k, disparity in enumerate((None, np.float32([[3, 3]]))):
        write_light_field(
            tmp_path / f"{k}", "hci", GridShape(1, 1), [replace(views[0], disparity=disparity)], 12.5, "a"
        )
        low, high = open_light_field(tmp_path / f"{k}").range_px
        assert -2 < low < high < 4, "also of flat views and unknown disparity"
    if scale.range_px:
        views = [replace(view, disparity=None) for view in views]
    path = tmp_path / "field"
    write_light_field(path, "hci", GridShape(1, 1), views, 12.5, "field", scale=scale)
    for disparity in scale.range_px or (-1.9, 0.0, 1.9):
        expected = 12.5 * step_mm / (disparity - infinity)
        assert benchmark_depth(path, disparity) == pytest.approx(expected, rel=1e-3)
    again = open_light_field(path)
    assert again.range_px == pytest.approx(scale.range_px or (-1.9, 1.9))
    assert again.infinity_px == pytest.approx(infinity, abs=1e-3)


@pytest.mark.parametrize("layout", WRITERS)
def test_an_incomplete_or_interrupted_field_leaves_nothing_and_keeps_the_older_one(tmp_path, layout) -> None:
    def interrupted() -> Iterator[ViewUpdate]:
        yield from make_views()[:7]
        raise KeyboardInterrupt

    for has_older in (False, True):
        with pytest.raises(InputError, match="only 14 of 15 views"):
            write(tmp_path, make_views()[:-1], layout)
        with pytest.raises(KeyboardInterrupt):
            write(tmp_path, interrupted(), layout)
        assert list(tmp_path.iterdir()) == ([tmp_path / NAMES[layout]] if has_older else [])
        write(tmp_path, make_views(), layout)
        assert open_light_field(tmp_path / NAMES[layout]).grid == GRID
