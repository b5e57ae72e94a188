"""Files that hold several views, dropped on a real window."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.beyond import between_views
from iibr_core.formats.light_fields.write import write_light_field
from iibr_core.formats.quilts import Quilt, lay_out
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.scenes.scene import Scene
from iibr_core.types import (
    GridShape,
    ImageSize,
    ViewOffset,
    ViewUpdate,
)
from tests.iibr_core.known_scenes import view_of_wall
from tests.viewer.conftest import Driver
from viewer.model import messages
from viewer.model.action import do

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


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """No view between others is made while this is not set."""
    gate, made = threading.Event(), between_views.densify

    def held(given: object, sparse: object, dense: object, *rest: object) -> object:
        while not gate.wait(0.01):
            raise_if_stopped()
        return made(given, sparse, dense, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(between_views, "densify", held)
    gate.set()
    yield gate
    gate.set()


def open_lenslet_image(viewer: Driver, folder: Path) -> Scene:
    path = write_lenslet_image(folder)
    viewer.app.window.on_drop(None, [str(path)])
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.source.path == str(path))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.depth_source != "none")
    viewer.until_idle()
    viewer.app.do(do(messages.dismiss))
    assert viewer.app.state.scene is not None
    return viewer.app.state.scene
