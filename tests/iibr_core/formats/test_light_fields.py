"""Every layout opens through one function; views come in order, with disparity in px per step of the grid."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from iibr_core.evaluation.scenes import read_scene
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import disparity_range, read_stored_view, read_views
from iibr_core.types import GridShape
from tests.iibr_core.known_scenes import (
    disparity_of_square,
    write_grid,
    write_hci,
    write_llff_row,
    write_stanford,
    write_stereo_pair,
)

LAYOUTS: dict[str, tuple[Callable[[Path], Path], str, GridShape | None]] = {
    "hci": (lambda to: write_hci(to, 3, 5), "HCI 4D light field, 5x3", GridShape(3, 5)),
    "views": (write_grid, "grid folder, 3x3", GridShape(3, 3)),
    "stanford": (lambda to: write_stanford(to, 2, 3), "Stanford archive, 3x2", GridShape(2, 3)),
    "middlebury": (write_stereo_pair, "Middlebury pair", GridShape(1, 2)),
    "llff": (write_llff_row, "LLFF, 3 photos", None),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_viewer_and_the_evaluation_open_every_layout(tmp_path: Path, name: str) -> None:
    write, layout, grid = LAYOUTS[name]
    folder = write(tmp_path / "scene")
    scene, judged = open_light_field(folder), read_scene(folder)
    assert judged is not None
    assert (scene.name, scene.layout, scene.grid) == ("scene", layout, grid)
    assert [view.path for view in scene.views] == [view.path for view in judged.views]
    if grid is not None:
        size, views = read_views(scene)
        by_place = {(view.row, view.column): view for view in views}
        assert sorted(by_place) == list(np.ndindex(*grid))
        distances = [np.hypot(*grid.offset(*place)) for place in by_place]
        assert distances == sorted(distances)
        for (row, column), view in by_place.items():
            assert view.colors.shape == (*size, 3)
            np.testing.assert_array_equal(view.colors, read_stored_view(scene, row, column))
        assert sum(view.disparity is not None for view in by_place.values()) == len(scene.disparity)


def test_the_range_is_stated_or_that_of_the_map_nearest_to_the_centre(tmp_path: Path) -> None:
    folder = write_grid(tmp_path / "scene", 5)
    assert disparity_range(open_light_field(folder)) == (0.5, 2.0)
    (folder / "gt_disp_u02_v02.npy").unlink()
    assert disparity_range(open_light_field(folder)) is None
    np.save(folder / "gt_disp_u00_v00.npy", 2 * disparity_of_square())
    np.save(folder / "gt_disp_u03_v02.npy", 3 * disparity_of_square())
    assert disparity_range(open_light_field(folder)) == (1.5, 6.0)
    (folder / "parameters.cfg").write_text("[meta]\ndisp_min = -1\ndisp_max = 7\n")
    assert disparity_range(open_light_field(folder)) == (-1, 7)
