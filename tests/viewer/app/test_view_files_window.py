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
from viewer.model.action import ask, do
from viewer.model.actions import OpenPath, SetDepthStrength, StopWork, Undo
from viewer.model.commands import COMMANDS
from viewer.model.dense_grid import with_views_between
from viewer.model.state.filling import FillTask
from viewer.model.state.jobs import CancelJobTask
from viewer.model.state.optics_actions import SetAperture, SetFocus

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


def fill_between(viewer: Driver) -> None:
    (fill,) = (command for command in COMMANDS if command.name == "Make views between those of a light field")
    viewer.app.do(fill.action(viewer.app.state))
    viewer.until(lambda app: bool(app.state.jobs))


def until_filled(viewer: Driver) -> Scene:
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.grid == (5, 5))
    viewer.until_idle()
    assert viewer.app.state.scene is not None
    assert viewer.app.state.views_there == set(np.ndindex(5, 5))
    assert viewer.app.scene_view.is_whole
    assert [notice.text for notice in viewer.app.state.notices if notice.is_error] == []
    return viewer.app.state.scene


def test_views_between_those_of_a_file_are_made_shown_and_taken_back(
    viewer: Driver, tmp_path: Path, gate: threading.Event
) -> None:
    """Whatever is touched meanwhile; the picture is that of the views on disk until all are there."""
    on_disk = open_lenslet_image(viewer, tmp_path)
    gate.clear()
    fill_between(viewer)
    for touched in (SetAperture(1.5), SetFocus(0.8), SetDepthStrength(0.5, is_finished=True), StopWork(), Undo()):
        viewer.app.do(touched)
        viewer.app.step()
    assert viewer.app.state.scene == on_disk
    assert viewer.app.state.views_there == set(np.ndindex(3, 3))
    gate.set()
    denser = until_filled(viewer)
    assert denser.subject_disparity_px == pytest.approx(DISPARITY / 2, abs=0.05)
    assert viewer.app.state.optics.aperture_diameter == pytest.approx(3.0), "twice as many steps"
    assert viewer.app.state.zoom is None
    viewer.app.do(do(ask, FillTask(with_views_between(denser, GridShape(3, 3)))))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.grid == (3, 3))
    viewer.until_idle()
    gate.clear()  # they are there, and not made again
    viewer.app.do(do(ask, FillTask(denser.source)))
    until_filled(viewer)


def test_views_between_are_made_on_when_another_photo_is_opened_and_found_by_who_goes_back(
    viewer: Driver, tmp_path: Path, gate: threading.Event
) -> None:
    photo = viewer.app.state.source
    on_disk = open_lenslet_image(viewer, tmp_path)
    assert photo is not None
    gate.clear()
    fill_between(viewer)
    viewer.app.do(OpenPath(photo))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.source.path == photo.path)
    gate.set()
    viewer.until(lambda app: not app.state.jobs)
    assert ["are ready" in notice.text for notice in viewer.app.state.notices] == [True]
    assert viewer.app.state.scene is not None
    assert viewer.app.state.scene.source.path == photo.path
    gate.clear()  # they are there, and not made again
    viewer.app.do(OpenPath(on_disk.source))
    until_filled(viewer)


def test_a_fill_is_given_up_by_its_button_or_for_another_grid(
    viewer: Driver, tmp_path: Path, gate: threading.Event
) -> None:
    scene = open_lenslet_image(viewer, tmp_path)
    gate.clear()
    fill_between(viewer)
    viewer.app.do(do(ask, FillTask(with_views_between(scene, GridShape(9, 9)))))
    viewer.until(lambda app: [job.fills for job in app.state.jobs] == [with_views_between(scene, GridShape(9, 9))])
    viewer.app.do(do(ask, CancelJobTask(viewer.app.state.jobs[0].id)))
    viewer.until(lambda app: not app.state.jobs)
    gate.set()
    viewer.until_idle()
    assert viewer.app.state.scene == scene
    assert not viewer.app.state.notices
