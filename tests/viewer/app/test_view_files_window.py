"""Files that hold several views, dropped on a real window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.light_fields.write import write_light_field
from iibr_core.formats.quilts import Quilt, lay_out
from iibr_core.scenes.scene import Scene
from iibr_core.types import (
    GridShape,
    ImageSize,
    ViewOffset,
    ViewUpdate,
)
from tests.iibr_core.known_scenes import view_of_wall
from tests.viewer.conftest import Driver

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
    views = (ViewUpdate(*at, wall(*grid.offset(*at)), None) for at in np.ndindex(*grid))
    write_light_field(folder / "wall_eslf.png", "eslf", grid, views, 60.0, "wall")
    return folder / "wall_eslf.png"


def test_files_of_views_dropped_are_light_fields_stereo_photos_and_bad_ones_notices(
    viewer: Driver, tmp_path: Path
) -> None:
    for write, grid in ((write_quilt, GridShape(1, 6)), (write_lenslet_image, GridShape(3, 3))):
        scene = drop(viewer, write(tmp_path))
        assert (scene.name, scene.grid, scene.plan) == ("wall", grid, None)
        assert scene.subject_disparity_px == pytest.approx(DISPARITY, abs=0.1)
        assert [notice.text for notice in viewer.app.state.notices if notice.is_error] == []
    left, right = (Image.fromarray(wall(0, s)) for s in (0, 3))
    left.save(tmp_path / "wall.mpo", "MPO", save_all=True, append_images=[right], quality=95)
    scene = drop(viewer, tmp_path / "wall.mpo")
    assert scene.plan is not None
    assert scene.depth_origin is not None
    assert scene.depth_origin.words == "the photo's two views (MPO stereo)"
    for name in ("wall_qs0x2a1.png", "odd_eslf.png", "raw.lfp"):
        Image.fromarray(wall(0, 0)[:-1]).save(tmp_path / name, "PNG")
        viewer.app.window.on_drop(None, [str(tmp_path / name)])
        viewer.until(lambda app, name=name: any(name in notice.text for notice in app.state.notices))  # type: ignore[misc]
        assert viewer.app.state.scene == scene


def drop(viewer: Driver, path: Path) -> Scene:
    """Drop a file on the window and return its scene, with depth."""
    viewer.app.window.on_drop(None, [str(path)])
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.source.path == str(path))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.depth_source != "none")
    viewer.until_idle()
    assert viewer.app.state.scene is not None
    return viewer.app.state.scene
