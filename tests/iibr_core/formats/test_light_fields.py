import configparser
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.evaluation.scenes import read_scene
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import disparity_range, read_stored_view, read_views
from iibr_core.formats.light_fields.write import WRITERS, write_light_field
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import GridShape, InputError, ViewUpdate
from tests.iibr_core import known_scenes as known

LAYOUTS: dict[str, tuple[Callable[[Path], Path], str, GridShape]] = {
    "hci": (lambda to: known.write_hci(to, 3, 5), "HCI 4D light field, 5x3", GridShape(3, 5)),
    "views": (known.write_grid, "grid folder, 3x3", GridShape(3, 3)),
    "stanford": (lambda to: known.write_stanford(to, 2, 3), "Stanford archive, 3x2", GridShape(2, 3)),
    "middlebury": (known.write_stereo_pair, "Middlebury pair", GridShape(1, 2)),
    "llff": (known.write_llff_row, "LLFF, 3x1", GridShape(1, 3)),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_viewer_and_the_evaluation_open_every_layout(tmp_path, name) -> None:
    write, layout, grid = LAYOUTS[name]
    folder = write(tmp_path / "scene")
    scene, judged = open_light_field(folder), read_scene(folder)
    assert (scene.name, scene.layout, scene.grid) == ("scene", layout, grid)
    assert [view.path for view in scene.views] == [view.path for view in judged.views]
    size, views = read_views(scene)
    by_place = {(view.row, view.column): view for view in views}
    assert sorted(by_place) == list(np.ndindex(*grid))
    distances = [np.hypot(*grid.offset(*place)) for place in by_place]
    assert distances == sorted(distances)
    for (row, column), view in by_place.items():
        assert view.colors.shape == (*size, 3)
        np.testing.assert_array_equal(view.colors, read_stored_view(scene, row, column))
    assert sum(view.disparity is not None for view in by_place.values()) == len(scene.disparity)


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
    by_place = {(view.row, view.column): view for view in read_views(scene)[1]}
    assert len(by_place) == len(views)
    for view in views:
        read = by_place[view.row, view.column]
        assert read.colors.dtype == dtype
        tolerance = {"rtol": 4e-3, "atol": 1e-3} if dtype == np.float16 else {"atol": 0}
        np.testing.assert_allclose(read.colors.astype(float), view.colors.astype(float), **tolerance)
        np.testing.assert_array_equal(read.disparity, view.disparity)


def test_hci_files_and_parameters_are_those_of_the_benchmark(tmp_path) -> None:
    views = make_views()
    folder = write(tmp_path, views)
    numbered = {name for i in range(15) for name in (f"input_Cam{i:03d}.png", f"disp_Cam{i:03d}.pfm")}
    assert {path.name for path in folder.iterdir()} == {*numbered, "gt_disp_lowres.pfm", "parameters.cfg"}
    centre = next(view for view in views if (view.row, view.column) == (1, 2))
    np.testing.assert_array_equal(read_pfm(folder / "gt_disp_lowres.pfm"), centre.disparity)
    parser = configparser.ConfigParser()
    parser.read(folder / "parameters.cfg")
    assert (parser["extrinsics"]["num_cams_x"], parser["extrinsics"]["num_cams_y"]) == ("5", "3")
    assert parser["intrinsics"]["image_resolution_x_px"] == "9"
    assert parser["meta"]["scene"] == "a scene"
    # Disparity 0 lies at the focus distance, the least disparity at infinity: d = f * b * (1 / z - 1 / focus).
    focus_mm = 1000 * float(parser["extrinsics"]["focus_distance_m"])
    assert 12.5 * 1.0 * -1 / focus_mm == pytest.approx(float(parser["meta"]["disp_min"]))


@pytest.mark.parametrize("dtype", [np.uint8, np.float16])
def test_a_lenslet_image_has_the_views_of_a_place_together(tmp_path, dtype) -> None:
    views = make_views(dtype=dtype)
    path = write(tmp_path, views, "eslf")
    pixels = np.asarray(Image.open(path))
    assert pixels.shape == (HEIGHT * GRID.rows, WIDTH * GRID.columns, 3)
    by_place = {(view.row, view.column): view.colors for view in read_views(open_light_field(path))[1]}
    for view in views:
        expected = view.colors if dtype == np.uint8 else np.rint(view.colors.astype(float).clip(0, 1) * 255)
        np.testing.assert_allclose(pixels[view.row :: GRID.rows, view.column :: GRID.columns], expected, atol=1)
        np.testing.assert_allclose(by_place[view.row, view.column].astype(int), expected, atol=1)


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
