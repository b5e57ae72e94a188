"""Light fields are written whole or not at all, and read again."""

import configparser
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import read_views
from iibr_core.formats.light_fields.write import WRITERS, write_light_field
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import GridShape, InputError, ViewUpdate

GRID = GridShape(3, 5)
HEIGHT, WIDTH = 6, 9
NAMES = {"hci": "field", "eslf": "field_eslf.png"}


def make_views(grid: GridShape = GRID, dtype: Any = np.uint8) -> list[ViewUpdate]:
    """Views of noise in any order."""
    rng = np.random.default_rng(5)
    views = []
    for row, column in np.ndindex(*grid):
        colors = rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
        colors = (colors / 64).astype(dtype) if dtype == np.float16 else colors
        views.append(ViewUpdate(row, column, colors, rng.uniform(-2, 3, (HEIGHT, WIDTH)).astype(np.float32)))
    return [views[i] for i in rng.permutation(len(views))]


def write(
    folder: Path, views: Iterable[ViewUpdate], layout: str = "hci", grid: GridShape = GRID, with_disparity: bool = True
) -> Path:
    path = folder / NAMES[layout]
    write_light_field(path, layout, grid, views, 12.5, "a\n scene", with_disparity)
    return path


@pytest.mark.parametrize("grid", [GRID, GridShape(1, 1), GridShape(1, 7)])
@pytest.mark.parametrize("dtype", [np.uint8, np.float16])
def test_hci_round_trip(tmp_path: Path, grid: GridShape, dtype: Any) -> None:
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
        assert read.disparity is not None
        np.testing.assert_array_equal(read.disparity, view.disparity)


def test_hci_files_and_parameters_are_those_of_the_benchmark(tmp_path: Path) -> None:
    views = make_views()
    folder = write(tmp_path, views)
    assert {path.name for path in folder.iterdir()} == {
        *(f"input_Cam{i:03d}.png" for i in range(15)),
        *(f"disp_Cam{i:03d}.pfm" for i in range(15)),
        "gt_disp_lowres.pfm",
        "parameters.cfg",
    }
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
def test_a_lenslet_image_has_the_views_of_a_place_together(tmp_path: Path, dtype: Any) -> None:
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
def test_an_incomplete_or_interrupted_field_leaves_nothing_and_keeps_the_older_one(tmp_path: Path, layout: str) -> None:
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
