"""Depth edited in a real window: the brush, the sliders and handles, undo, saving and opening maps, what is told."""

from dataclasses import replace

import numpy as np
import pytest
from imgui_bundle import imgui

from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.types import ViewOffset
from tests.viewer.conftest import FAR, NEAR
from viewer.model import depth, lens, messages, saving, window
from viewer.model.action import do
from viewer.model.browsing import PathPrompt
from viewer.model.depth import Brush
from viewer.model.preferences import SECTIONS
from viewer.model.saving import SavePrompt

pytestmark = pytest.mark.usefixtures("no_dialogs")
OPEN_SECTIONS = ("depth",)


def disparity_of(app):
    """What the views on the screen were made from, as given."""
    return app.scene_view.loaded.disparity.values


def is_made(app):
    """Whether the screen shows what was asked for last."""
    return app.scene_view.generation == app.state.generation


def until_made(viewer, generation):
    """Draw until the screen shows this generation of the scene."""
    viewer.settle(lambda app: app.state.generation == generation and is_made(app))


def press_at(viewer, x_share, y_share):
    """Put the pointer there and hold it down."""
    x, y = viewer.position(x_share, y_share)
    viewer.send("mousemove", x, y)
    viewer.until(lambda app: (imgui.get_io().mouse_pos.x, imgui.get_io().mouse_pos.y) == (x, y))
    viewer.send("mousedown", 1)
    viewer.until(lambda app: app.state.stroke is not None)


def test_a_stroke_is_seen_while_it_is_drawn_and_made_when_it_ends(viewer):
    viewer.app.do(
        do(lens.move_eye, ViewOffset(0.0, 1.0)), do(depth.set_brush, Brush(radius=0.1, strength=1.0, is_on=True))
    )
    viewer.until_idle()
    before, given = viewer.image(), disparity_of(viewer.app).copy()
    press_at(viewer, 0.5, 0.5)
    viewer.key("Escape", until=lambda app: app.state.stroke is None)
    viewer.send("mouseup", 1)
    viewer.settle(is_made)
    np.testing.assert_array_equal(disparity_of(viewer.app), given, "Escape takes a stroke back")
    assert len(viewer.app.state.history.past) == 1
    generation, plan = viewer.app.state.generation, viewer.app.state.scene.plan
    viewer.do(do(lens.set_focus, (NEAR - plan.disparity_zero) * plan.disparity_scale), do(window.end_gesture))
    before = viewer.image()
    press_at(viewer, 0.5, 0.5)
    viewer.until(lambda app: not np.array_equal(app.scene_view.renderer.read_image(), before))
    previews = viewer.app.scene_view.previews
    viewer.send("mousemove", *viewer.position(0.5, 0.6))
    viewer.until(lambda app: app.scene_view.previews > previews)
    assert viewer.app.state.generation == generation
    np.testing.assert_array_equal(disparity_of(viewer.app), given)
    viewer.send("mouseup", 1)
    until_made(viewer, generation + 1)
    assert viewer.app.scene_view.field.present.sum() == 9
    made = disparity_of(viewer.app)
    assert made.max() == pytest.approx(NEAR + (NEAR - FAR), abs=0.2)
    focus = viewer.app.state.optics.focus_disparity
    assert focus == viewer.field_disparity(NEAR), "the depth that was in focus, not its share of the new range"
    far = given == FAR
    np.testing.assert_array_equal(made[far], given[far], "the red square's contour holds the stroke")
    viewer.send("key", "ctrl+z")
    until_made(viewer, generation + 2)
    np.testing.assert_array_equal(disparity_of(viewer.app), given)
    viewer.send("key", "ctrl+shift+z")
    until_made(viewer, generation + 3)
    np.testing.assert_array_equal(disparity_of(viewer.app), made)
    viewer.key("Escape", until=lambda app: not app.state.brush.is_on)
    assert not viewer.app.state.should_quit


def test_the_bucket_fills_the_surface_that_is_clicked_with_the_depth_picked_elsewhere(viewer):
    given = disparity_of(viewer.app).copy()
    viewer.app.do(do(depth.set_brush, Brush(radius=0.15)))
    viewer.press("Bucket", until=lambda app: app.state.brush.is_on)
    viewer.send("mousemove", *viewer.position(0.1, 0.9))
    viewer.until_idle()
    viewer.send("keydown", "ctrl", "mousedown", 1)
    viewer.until(lambda app: app.state.brush.sample is not None)
    viewer.send("mouseup", 1, "keyup", "ctrl")
    viewer.until_idle()
    assert viewer.app.state.brush.tool == "fill"
    np.testing.assert_array_equal(disparity_of(viewer.app), given)
    press_at(viewer, 0.5, 0.5)
    viewer.send("mouseup", 1)
    until_made(viewer, 2)
    is_far = np.isclose(disparity_of(viewer.app), FAR)
    assert is_far[given == FAR].all()
    assert is_far[given == NEAR].mean() > 0.7


def test_the_key_of_the_brush_and_the_heading_of_its_section_bring_it_into_sight(viewer):
    """Its section opens and the panel scrolls there: the slider comes under a pointer that only goes down the panel."""
    sections = tuple(section for section in SECTIONS if section != "depth")
    preferences = replace(viewer.app.state.preferences, open_sections=sections)
    viewer.app.state = replace(viewer.app.state, preferences=preferences)
    viewer.send("mousemove", *viewer.position(0.5, 0.5))
    viewer.until_idle()
    panel = imgui.internal.find_window_by_name("panel")
    assert panel.scroll.y == 0
    viewer.key("b", settle=lambda app: app.state.brush.is_on)
    assert set(viewer.app.state.preferences.open_sections) == set(SECTIONS)
    assert panel.scroll.y > 0
    viewer.press("Smooth", settle=lambda app: app.state.brush == replace(app.state.brush, tool="smooth", is_on=True))
    viewer.slide("##Size", 0.9)
    assert viewer.app.state.brush.radius > 0.1
    viewer.key("b", until=lambda app: not app.state.brush.is_on)
    viewer.press("###section Depth", settle=lambda app: "depth" not in app.state.preferences.open_sections)
    _, y = viewer.find("###section Depth")
    panel.scroll.y -= max(panel.pos.y + panel.size.y - y - 40, 0)  # so that the heading lies at the bottom
    viewer.until_idle()
    viewer.press("###section Depth")
    before = panel.scroll.y
    viewer.settle(lambda app: "depth" in app.state.preferences.open_sections)
    assert panel.scroll.y > before


def test_sliders_and_handles_change_the_map_once_they_are_let_go(viewer):
    viewer.slide("##Far clip", 0.2)
    until_made(viewer, 2)
    assert 0 < viewer.app.state.depth.edits.far_clip < 0.5
    # where `find` looks
    viewer.app.do(
        do(depth.set_tone, replace(viewer.app.state.depth.edits, near_clip=0.77), is_finished=True),
        do(window.end_gesture),
    )
    until_made(viewer, 3)
    x, y = viewer.find("handle near_clip")
    viewer.send("mousedown", 1)
    viewer.app.step()
    previews = viewer.app.scene_view.previews
    viewer.send("mousemove", x - 60, y)
    viewer.until(lambda app: app.state.depth.edits.near_clip < 0.7 and app.scene_view.previews > previews)
    assert viewer.app.state.generation == 3
    viewer.send("mouseup", 1)
    until_made(viewer, 4)
    assert disparity_of(viewer.app).max() < NEAR
    assert len(viewer.app.state.history.past) == 3


def test_a_map_is_saved_and_opened_again_by_its_path(viewer, photo_path, tmp_path):
    viewer.press("Invert")
    until_made(viewer, 2)
    wanted = disparity_of(viewer.app).copy()
    viewer.do(do(saving.ask_to_save, "map"), settle=lambda app: isinstance(app.state.prompt, SavePrompt))
    out = tmp_path / "turned.npy"
    viewer.enter(out.name, settle=lambda app: out.exists())
    np.testing.assert_array_equal(np.load(out), wanted)
    assert str(out) in viewer.app.state.notices[-1].text
    viewer.do(do(messages.show_prompt, PathPrompt("map")))
    viewer.enter(out.name, until=lambda app: app.state.source is not None and app.state.source.depth.file == str(out))
    viewer.settle(is_made)
    assert viewer.app.state.depth.edits == DepthEdits()
    np.testing.assert_array_equal(disparity_of(viewer.app), wanted)
    assert "turned.npy" in viewer.app.state.scene.depth_origin.line


def test_edits_need_no_photo_and_survive_a_bad_map(viewer, photo_path, tmp_path):
    photo_path.unlink()
    viewer.press("Refine edges")
    until_made(viewer, 2)
    assert not viewer.app.state.depth.refine
    viewer.press("Invert")
    until_made(viewer, 3)
    bad = tmp_path / "bad.pfm"
    bad.write_bytes(b"no map")
    viewer.drop(bad, until=lambda app: bool(app.state.notices))
    viewer.settle(is_made)
    assert viewer.app.state.notices[-1].is_error
    assert viewer.app.state.depth.edits.is_inverted
    assert disparity_of(viewer.app)[0, 0] == NEAR


def test_a_click_selects_a_surface_to_move_it_and_to_keep_it_sharp(viewer):
    app = viewer.app
    app.do(do(depth.set_brush, Brush("select", is_on=True)))
    viewer.send("mousemove", *viewer.position(0.5, 0.5), "click", 1)
    viewer.settle(lambda app: app.state.selection is not None and app.state.selection.range_px is not None)
    near = app.scene_view.pick(ViewOffset(0, 0), 48, 32)
    assert app.state.selection.range_px == (pytest.approx(near, abs=0.05), pytest.approx(near, abs=0.05))
    overlay = app.inspection_view.draw(app.state, app.layout()).overlay
    assert overlay is not None
    assert app.state.stroke is None
    before = disparity_of(app).copy()
    viewer.press("Farther##surface")
    until_made(viewer, 2)
    moved = disparity_of(app) - before
    assert moved[32, 48] == pytest.approx(-0.1 * (NEAR - FAR), abs=0.01)
    assert moved[4, 4] == 0, "the wall stays"
    viewer.until(lambda app: app.state.selection is not None and app.state.selection.range_px[1] < near - 0.05)
    viewer.press("Keep sharp", until=lambda app: app.state.optics.aperture_diameter > 0)
    assert app.state.optics.focus_disparity == pytest.approx(app.scene_view.pick(ViewOffset(0, 0), 48, 32), abs=0.05)
    viewer.key("Escape", until=lambda app: app.state.selection is None)
    assert app.state.brush.is_on
