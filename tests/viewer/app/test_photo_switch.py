"""All that can be changed of a photo, in a real window: nothing of it stays for the next photo, undo takes it back,
redo brings it again, and the photo opens again as it was left, after a crash, too.
"""

import os
import shutil
from dataclasses import fields, replace

import numpy as np
import pytest
from PIL import Image, ImageGrab

from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import rests, says, shows, write_scene
from tests.viewer.model.told import words
from viewer.model import depth, history, inspection, lens, opening, selection, viewpoint, window
from viewer.model.action import do
from viewer.model.depth import DepthSample
from viewer.model.layout import Zoom

GRID = GridShape(3, 3)
OF_THE_PROGRAM = {
    *("source", "scene", "generation", "shown_generation", "progress", "preferences", "recent", "existing_recent"),
    *("report", "notices", "models", "facts", "folder", "exports", "last_export", "tasks", "has_dialogs", "monitors"),
    *("hides_panel", "is_narrow", "inspection", "brush"),
}
"""Parts of the state that do not belong to a photo, or name its file; the test compares what of them is the photo's."""

SAMPLING_LEVELS = 24
"""Largest difference of two pictures through an open lens at rest, of 255; parts of another photo differ by 50."""


def of_the_photo(state):
    """Return all that a photo has in the state."""
    found = {field.name: getattr(state, field.name) for field in fields(state) if field.name not in OF_THE_PROGRAM}
    look = state.inspection
    return found | {
        "brush's depth": state.brush.sample,
        "findings": (look.place, look.probe, look.snapshot),
        "notices": [notice.text for notice in state.notices if "." in notice.text and not notice.is_result],
        "range": state.scene.disparity_range_px if state.scene is not None else None,
    }


def everything(driver):
    """Change all that can be changed of the open photo, and look at it in every way."""

    def change(*actions):
        driver.do(*actions)

    change(do(depth.set_tone, replace(UNEDITED, gamma=1.5), is_finished=True))
    brush = replace(driver.app.state.brush, is_on=True, radius=0.2)
    change(do(depth.set_brush, brush), do(depth.paint, (0.4, 0.5)), do(window.end_gesture))
    change(do(depth.set_brush, replace(brush, tool="level")), do(depth.pick, DepthSample((0.5, 0.5), 1.0)))
    change(do(depth.set_brush, replace(driver.app.state.brush, is_on=False)), do(selection.select, (0.5, 0.5)))
    change(do(lens.set_depth_strength, 1.5, is_finished=True), do(lens.focus_on, (0.5, 0.5), 0.5))
    change(do(lens.set_gloss, Gloss(roughness=0.5, reflectance=0.5)))
    change(do(lens.set_focus_tilt, (0.3, 0.1)), do(lens.show_tilt_handles, True), do(lens.set_dolly, 0.3))
    change(do(viewpoint.set_zoom, Zoom(8.0, (0.4, 0.6))), do(inspection.set_overlay, "inpainted"))
    change(do(inspection.take_snapshot), do(inspection.compare, "snapshot"), do(inspection.set_overlay, "disparity"))
    change(do(viewpoint.set_loop, "swing"), do(viewpoint.pause, True), do(lens.move_eye, ViewOffset(0.7, -0.6)))
    change(do(inspection.compare, None), do(inspection.set_overlay, None))


def leave_picture(driver):
    """Move the pointer to where it points at nothing."""
    driver.send("mousemove", 3, 3)
    driver.until(lambda app: app.state.hover is None)


def seen(driver):
    """Return the window's picture at rest, from a corner, with each map, with an open lens and with gloss."""
    app, pictures = driver.app, []
    looks = (
        (), (do(lens.move_eye, ViewOffset(1.0, 1.0)),),
        (do(inspection.set_overlay, "inpainted"),), (do(inspection.set_overlay, "disparity"),),
        (do(inspection.set_overlay, None), do(lens.set_aperture, 2.0), do(lens.set_focus, 0.3)),
        (do(lens.set_gloss, Gloss(roughness=0.5, reflectance=0.5)),),
    )  # fmt: skip
    for actions in looks:
        app.do(*actions)
        leave_picture(driver)
        driver.settle(lambda app: app.scene_view.gloss_request(app.state.optics.gloss) is None)
        place, frame = app.window.place, app.layout().frame
        left, top = place[0] + frame.x, place[1] + frame.y
        box = left + 8, top + 40, left + frame.width - 8, top + frame.height - 40
        pictures.append(np.asarray(ImageGrab.grab(xdisplay=os.environ["DISPLAY"]).convert("RGB").crop(box)).astype(int))
    return pictures


def next_photo(folder):
    """Write a mirrored photo of another scene: everything lies elsewhere."""
    path = write_scene(folder, "next", seed=3)
    Image.open(path).transpose(Image.Transpose.ROTATE_180).save(path)
    map_path = folder / "next_disparity.npy"
    np.save(map_path, np.roll(np.load(map_path), 16, axis=1)[::-1, ::-1])
    return path


@pytest.mark.usefixtures("wide_window")
def test_the_next_photo_is_shown_as_if_it_were_the_first(open_window, tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    after, first = next_photo(tmp_path / "b"), write_scene(tmp_path / "a")
    driver = open_window(first).until_idle()
    everything(driver)
    before = of_the_photo(driver.app.state)
    leave_picture(driver)
    driver.do(do(opening.open_source, Source(str(after), grid=GRID)), settle=shows("next"))
    state, pictures = of_the_photo(driver.app.state), seen(driver)
    driver.close()
    fresh = open_window(after).until_idle()
    leave_picture(fresh)
    expected = of_the_photo(fresh.app.state)
    assert sum(before[name] != expected[name] for name in expected) > 10, "much was changed"
    assert state == expected
    for found, wanted in zip(pictures, seen(fresh), strict=True):
        assert np.abs(found - wanted).max() <= SAMPLING_LEVELS


def edited(driver):
    """Return what undo restores and a session keeps, in words: another plan and back rounds numbers."""
    state = driver.app.state
    return words((state.optics, state.depth, state.depth_strength))


def at_rest(driver):
    """Return the settings and the picture at rest, without an overlay."""
    leave_picture(driver)
    driver.settle(lambda app: app.scene_view.gloss_request(app.state.optics.gloss) is None)
    return edited(driver), driver.image().astype(int)


def assert_alike(found, wanted):
    assert found[0] == wanted[0]
    assert np.abs(found[1] - wanted[1]).max() <= SAMPLING_LEVELS


@pytest.mark.usefixtures("wide_window")
def test_all_is_undone_done_again_and_there_again_after_a_crash(open_window, tmp_path, monkeypatch):
    monkeypatch.setattr("viewer.app.session_store.QUIET_S", 0.0)
    (tmp_path / "photos").mkdir()
    path, kept, crashed = next_photo(tmp_path / "photos"), tmp_path / "kept", tmp_path / "crashed"
    driver = open_window(path, kept_in=kept).until_idle()
    fresh = at_rest(driver)
    assert not list(kept.rglob("sessions/*.json")), "nothing was changed yet"
    everything(driver)
    driver.do(do(viewpoint.set_loop, None), do(viewpoint.set_zoom, None), do(window.end_gesture))
    left, focused_at = at_rest(driver), driver.app.state.focused_at
    assert np.abs(left[1] - fresh[1]).max() > 2 * SAMPLING_LEVELS
    driver.until(lambda app: bool(list(kept.rglob("sessions/*.json"))) and rests(app))
    shutil.copytree(kept / "sessions", crashed / "sessions", ignore=shutil.ignore_patterns(".*"))
    while driver.app.state.history.past:
        driver.app.do(do(history.undo))
    driver.until_idle()
    assert_alike(at_rest(driver), fresh)
    while driver.app.state.history.future:
        driver.app.do(do(history.redo))
    driver.until_idle()
    assert_alike(at_rest(driver), left)
    driver.do(do(viewpoint.set_loop, "circle"), until=lambda app: app.state.motion.turns > 0.05)
    driver.close()
    again = open_window(path, kept_in=kept)
    again.settle(says("as you left it"))
    assert edited(again) == left[0], "where the motion began"
    again.close()
    again = open_window(path, kept_in=crashed)
    again.settle(says("as you left it"))
    assert_alike(at_rest(again), left)
    assert (again.app.state.focused_at, again.app.state.motion.kind) == (focused_at, None)
    again.do(do(history.undo))
    assert_alike(at_rest(again), fresh)
