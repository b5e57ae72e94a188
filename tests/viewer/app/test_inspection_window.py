"""Inspection in a real window: keys, clicks, drags and drops; what each costs; scores when all is still."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.write import write_light_field
from iibr_core.method.light_field import generate
from iibr_core.method.plan import plan_literal
from iibr_core.scenes.photo import load_photo
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import Driver, Opener, write_scene
from viewer.app.dropped_files import actions_from_drop
from viewer.app.main_loop import App, initial_state
from viewer.model.actions import OpenPath
from viewer.model.inspection_request import sheet_cells
from viewer.model.state.app_state import AppState
from viewer.model.state.inspection import Compare, KeepState, SetInspection, SetOverlay
from viewer.model.state.optics_actions import MoveEye, SetAperture
from viewer.model.state.preferences import ToggleSection
from viewer.model.state.tasks import ReadTruthTask

GRID = GridShape(5, 5)


@pytest.fixture
def viewer(open_window: Opener, photo_path: Path) -> Driver:
    driver = open_window(photo_path, grid=GRID)
    driver.until_idle()
    driver.send("mousemove", *driver.position(0.1, 0.1))
    driver.until(lambda app: app.state.hover is not None)
    driver.until_idle()
    return driver


def write_truth(photo: Path, folder: Path, shift: int = 0) -> Path:
    """The light field that the photo gives at its disparity as it is, brighter by `shift` steps of 255."""
    loaded = load_photo(Source(str(photo)))
    plan = plan_literal(loaded.photo, loaded.disparity, GRID)
    views = (
        replace(view, colors=np.minimum(view.colors, 255 - shift) + np.uint8(shift))
        for view in generate(loaded.photo, plan.field_disparity(loaded.disparity), plan)
    )
    write_light_field(folder, "hci", GRID, views, 100.0, folder.name)
    return folder


def is_scored(app: App) -> bool:
    pair = app.state.inspection.pair
    return pair is not None and pair.flip is not None


def test_epis_follow_the_pointer_and_cost_no_picture(viewer: Driver) -> None:
    viewer.send("key", "e")
    viewer.until(lambda app: app.state.inspection.shows_epis)
    viewer.until_idle()
    app = viewer.app
    assert app.layout().strip_across is not None
    shown = app.inspection_view.draw(app.state, app.layout())
    assert shown.strip_across is not None
    drawn, frames = app.scene_view.pictures_drawn, app.frames_shown
    viewer.send("mousemove", *viewer.position(0.5, 0.6))
    viewer.until(lambda app: app.state.hover is not None and app.state.hover.y_px > 30)
    viewer.until_idle()
    moved = app.inspection_view.draw(app.state, app.layout())
    assert moved != shown
    assert app.scene_view.pictures_drawn == drawn
    assert app.frames_shown > frames
    frames = app.frames_shown
    for _ in range(3):
        app.step()
    assert app.frames_shown == frames, "idle draws nothing"


def test_a_click_on_the_sheet_goes_to_the_view_and_escape_leaves_it(viewer: Driver) -> None:
    viewer.send("key", "g")
    viewer.until(lambda app: app.state.inspection.shows_grid)
    picture = viewer.app.layout().picture
    assert picture is not None
    cell = sheet_cells(picture, GRID)[1 * GRID.columns + 4]
    viewer.send("mousemove", round(cell.x + cell.width / 2), round(cell.y + cell.height / 2), "click", 1)
    viewer.until(lambda app: app.state.optics.eye == ViewOffset(-1, 2))
    viewer.until_idle()
    assert viewer.app.state.optics == Optics(eye=ViewOffset(-1, 2)), "nothing was focused"
    assert viewer.app.state.inspection.shows_grid
    viewer.send("key", "Escape")
    viewer.until(lambda app: not app.state.inspection.shows_grid)
    assert not viewer.app.state.should_quit


def test_the_divider_is_dragged_and_the_viewpoint_stays(viewer: Driver) -> None:
    viewer.send("key", "p")
    viewer.until(lambda app: app.state.inspection.comparison == "photo")
    x, y = viewer.position(0.5, 0.7)
    viewer.send("mousemove", x, y, "mousedown", 1)
    viewer.app.step()
    viewer.send("mousemove", x - 20, y)
    viewer.app.step()
    viewer.send("mousemove", *viewer.position(0.2, 0.7))
    viewer.until(lambda app: abs(app.state.inspection.divider - 0.2) < 0.01)
    assert viewer.app.state.inspection.divider_taken
    viewer.send("mouseup", 1)
    viewer.until(lambda app: not app.state.inspection.divider_taken)
    assert viewer.app.state.optics == Optics()
    viewer.send("mousemove", *viewer.position(0.2, 0.4), "click", 1)
    viewer.until_idle()
    assert viewer.app.state.optics == Optics(), "a click on the divider focuses nothing"


def test_buttons_of_the_section_and_the_values_under_the_pointer(viewer: Driver) -> None:
    viewer.app.do(*(ToggleSection(section) for section in ("view", "focus", "aperture", "light", "inspect")))  # type: ignore[arg-type]
    viewer.until_idle()
    viewer.press("Values")
    viewer.until(lambda app: app.layout().status is not None)
    viewer.press("Depth")
    viewer.until(lambda app: app.state.inspection.overlay == "disparity")
    viewer.slide("##Opacity", 0.25)
    assert 0.1 < viewer.app.state.inspection.opacity < 0.4
    viewer.press("Entropy")
    viewer.until(lambda app: app.inspection_view.draw(app.state, app.layout()).overlay is not None)
    viewer.press("Entropy")
    viewer.until(lambda app: app.state.inspection.overlay is None)
    viewer.send("mousemove", *viewer.position(0.5, 0.5))
    viewer.until(lambda app: app.state.inspection.probe is not None)
    probe = viewer.app.state.inspection.probe
    assert probe is not None
    assert (probe.of, probe.seen_in, probe.origin) == (25, 25, "photo")
    viewer.send("mousemove", round(viewer.app.layout().panel.x + 30), 500)
    viewer.until(lambda app: app.state.inspection.probe is None)


def test_a_folder_dropped_on_the_panel_is_ground_truth(viewer: Driver, photo_path: Path, tmp_path: Path) -> None:
    truth = write_truth(photo_path, tmp_path / "truth", shift=3)
    app = viewer.app
    app.do(ToggleSection("inspect"))
    viewer.send("mousemove", round(app.layout().panel.x + 100), 300)
    viewer.until(lambda app: app.state.hover is None)
    app.window.on_drop(None, [str(truth)])
    viewer.until(is_scored)
    pair, scene = app.state.inspection.pair, app.state.scene
    assert pair is not None
    assert scene is not None
    assert (scene.name, pair.kind, pair.view) == ("scene", "truth", (2, 2))
    assert pair.psnr_db == pytest.approx(20 * math.log10(255 / 3), abs=0.1)
    app.do(MoveEye(ViewOffset(-2, 1)))
    viewer.until(lambda app: is_scored(app) and app.state.inspection.pair.view == (0, 3))  # type: ignore[union-attr]
    textures = app.inspection_view.draw(app.state, app.layout())
    assert textures.left is not None
    assert textures.right is not None


def test_dropped_elsewhere_a_folder_is_opened(viewer: Driver) -> None:
    state = viewer.app.state
    (opened,) = actions_from_drop(["/fields/truth"], state)
    assert isinstance(opened, OpenPath)
    (asked,) = actions_from_drop(["/fields/truth"], state, is_ground_truth=True)
    assert getattr(asked, "task", None) == ReadTruthTask("/fields/truth")
    assert isinstance(actions_from_drop(["/fields/truth"], AppState(), is_ground_truth=True)[0], OpenPath)


@pytest.mark.parametrize("damage", ["no folder", "no views", "a view missing", "another size"])
def test_ground_truth_that_is_no_use_is_a_notice(viewer: Driver, photo_path: Path, tmp_path: Path, damage: str) -> None:
    folder = tmp_path / "bad"
    if damage != "no folder":
        folder.mkdir()
    if damage in ("a view missing", "another size"):
        side = 32 if damage == "another size" else 64
        for index in range(9):
            write_image(folder / f"input_Cam{index:03d}.png", np.zeros((side, 96, 3), np.uint8))
    if damage == "a view missing":
        (folder / "input_Cam004.png").unlink()
        (folder / "parameters.cfg").write_text("[extrinsics]\nnum_cams_x = 3\nnum_cams_y = 3\n")
    app = viewer.app
    app.do(ToggleSection("inspect"))
    viewer.send("mousemove", round(app.layout().panel.x + 100), 300)
    viewer.until(lambda app: app.state.hover is None)
    viewer.until_idle()
    before = replace(app.state, notices=(), report=None)
    app.window.on_drop(None, [str(folder)])
    viewer.until(lambda app: bool(app.state.notices) and str(folder) in app.state.notices[-1].text)
    viewer.until_idle()
    assert app.state.notices[-1].is_error
    assert "\n" not in app.state.notices[-1].text
    assert replace(app.state, notices=(), report=None) == before


def test_ground_truth_of_the_command_line_waits_for_the_scene(
    open_window: Opener, photo_path: Path, tmp_path: Path
) -> None:
    truth = write_truth(photo_path, tmp_path / "truth")
    driver = open_window(None)
    app = driver.app
    app.state = replace(
        initial_state(OpenPath(Source(str(photo_path), grid=GridShape(3, 3))), ground_truth=str(truth)),
        preferences=app.state.preferences,
    )
    driver.until(is_scored)
    pair = app.state.inspection.pair
    assert pair is not None
    assert (pair.psnr_db, pair.flip) == (math.inf, 0)


def test_a_light_field_from_disk_beside_its_truth(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    made, truth = write_truth(photo_path, tmp_path / "made", shift=4), write_truth(photo_path, tmp_path / "truth")
    driver = open_window(made)
    driver.until_idle()
    app = driver.app
    app.do(SetInspection("shows_epis", True), SetOverlay("inpainted"))
    assert app.state.inspection.overlay is None
    assert "read from disk" in app.state.notices[-1].text
    app.do(MoveEye(ViewOffset(1, -1)))
    app.state = replace(app.state, tasks=(ReadTruthTask(str(truth)),))
    driver.until(is_scored)
    pair = app.state.inspection.pair
    assert pair is not None
    assert pair.view == (3, 1)
    assert pair.psnr_db == pytest.approx(20 * math.log10(255 / 4), abs=0.3), "stored as roots of light, within a step"
    other = write_scene(tmp_path, "other", seed=3)
    app.do(OpenPath(Source(str(other))))
    driver.until(lambda app: app.state.scene is not None and app.state.scene.name == "other")
    assert app.state.inspection.truth is None
    assert app.state.inspection.shows_epis
    driver.until_idle()


def test_a_picture_drawn_in_a_hurry_is_not_compared_before_it_is_whole(viewer: Driver) -> None:
    """It is smaller than the one that was kept, and a view that comes then leaves it unfinished."""
    app = viewer.app
    app.do(KeepState(), Compare("difference"))
    viewer.until_idle()
    drawn, renderer = app.scene_view.picture_drawn, app.scene_view.renderer
    assert drawn is not None
    renderer.render_in_time(replace(app.state.optics, aperture_diameter=3.0), drawn.size_px, 0.0)
    app.do(MoveEye(ViewOffset(0.3, 0.4)), KeepState())
    centre = app.scene_view.centre
    assert centre is not None
    renderer.upload_view(*GRID.centre, centre.colors, centre.disparity)
    app.scene_view.views_uploaded += 1
    app.inspection_view.draw(app.state, app.layout())


def test_a_snapshot_is_drawn_over_several_turns(viewer: Driver) -> None:
    """A turn draws for a short time only, so the window answers while a finished picture is drawn."""
    app = viewer.app
    app.do(MoveEye(ViewOffset(0.3, 0.4)), SetAperture(3.0), KeepState(), MoveEye(ViewOffset(0, 0)), Compare("kept"))
    viewer.until(lambda app: app.inspection_view.is_drawing)
    viewer.until_idle()
    assert not app.inspection_view.is_drawing
    assert app.inspection_view.draw(app.state, app.layout()).left is not None
