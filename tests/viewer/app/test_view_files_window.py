"""Files that hold several views, dropped on a real window."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.light_fields.registry import writer_for
from iibr_core.formats.quilts import Quilt, lay_out
from iibr_core.types import GridShape, ImageSize, ViewOffset, ViewUpdate
from tests.iibr_core.known_scenes import view_of_wall
from tests.viewer.conftest import Driver
from viewer.model.actions import OpenPath
from viewer.model.commands import COMMANDS
from viewer.model.dense_field import with_views_between

SIZE = 48, 64
DISPARITY = 1.0


def wall(t: float, s: float) -> np.ndarray:
    return np.rint(view_of_wall(ViewOffset(t, s), DISPARITY, SIZE) * 255).astype(np.uint8)


def write_quilt(folder: Path) -> Path:
    quilt = Quilt(3, 2, ImageSize(2 * SIZE[0], 3 * SIZE[1]), SIZE[1] / SIZE[0])
    path = folder / f"wall{quilt.tag}.png"
    Image.fromarray(lay_out(quilt, [wall(0, s - 3) for s in range(6)])).save(path)
    return path


def write_lenslet_image(folder: Path) -> Path:
    grid = GridShape(3, 3)
    with writer_for("eslf")(folder / "wall_eslf.png", grid, 60.0, "wall", False) as writer:
        for row, column in np.ndindex(*grid):
            writer.add(ViewUpdate(row, column, wall(*grid.offset(row, column)), None))
    return folder / "wall_eslf.png"


@pytest.mark.parametrize(("write", "grid"), [(write_quilt, GridShape(1, 6)), (write_lenslet_image, GridShape(3, 3))])
def test_a_file_of_views_dropped_is_a_light_field_with_disparity(
    viewer: Driver, tmp_path: Path, write: Callable[[Path], Path], grid: GridShape
) -> None:
    path = write(tmp_path)
    viewer.app.window.on_drop(None, [str(path)])
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.source.path == str(path))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.depth_source != "none")
    viewer.until_idle()
    scene = viewer.app.state.scene
    assert scene is not None
    assert (scene.name, scene.grid, scene.plan) == ("wall", grid, None)
    assert scene.subject_disparity_px == pytest.approx(DISPARITY, abs=0.1)
    assert [notice.text for notice in viewer.app.state.notices if notice.is_error] == []


def test_a_stereo_photo_dropped_is_a_photo_with_the_depth_of_its_views(viewer: Driver, tmp_path: Path) -> None:
    path = tmp_path / "wall.mpo"
    left, right = (Image.fromarray(wall(0, s)) for s in (0, 3))
    left.save(path, "MPO", save_all=True, append_images=[right], quality=95)
    viewer.app.window.on_drop(None, [str(path)])
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.source.path == str(path))
    viewer.until_idle()
    scene = viewer.app.state.scene
    assert scene is not None
    assert scene.plan is not None
    assert scene.depth_origin is not None
    assert scene.depth_origin.words == "the photo's two views (MPO stereo)"


@pytest.mark.parametrize("name", ["wall_qs0x2a1.png", "odd_eslf.png", "raw.lfp"])
def test_a_bad_one_leaves_the_scene_with_a_notice(viewer: Driver, tmp_path: Path, name: str) -> None:
    before = viewer.app.state.scene
    Image.fromarray(wall(0, 0)[:-1]).save(tmp_path / name, "PNG")
    viewer.app.window.on_drop(None, [str(tmp_path / name)])
    viewer.until(lambda app: any(name in notice.text for notice in app.state.notices))
    assert viewer.app.state.scene == before


def test_views_between_those_of_a_file_are_made_shown_and_taken_back(viewer: Driver, tmp_path: Path) -> None:
    path = write_lenslet_image(tmp_path)
    viewer.app.window.on_drop(None, [str(path)])
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.source.path == str(path))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.depth_source != "none")
    viewer.until_idle()
    on_disk = viewer.app.state.scene
    assert on_disk is not None
    (fill,) = (command for command in COMMANDS if command.name == "Fill between views")
    viewer.app.do(fill.action(viewer.app.state))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.grid == (5, 5))
    viewer.until_idle()
    denser = viewer.app.state.scene
    assert denser is not None
    assert viewer.app.state.views_there == set(np.ndindex(5, 5))
    assert denser.subject_disparity_px == pytest.approx(DISPARITY / 2, abs=0.05)
    assert viewer.app.state.zoom is None
    viewer.app.do(OpenPath(with_views_between(denser, GridShape(3, 3))))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.grid == (3, 3))
    viewer.until_idle()
    assert [notice.text for notice in viewer.app.state.notices if notice.is_error] == []
