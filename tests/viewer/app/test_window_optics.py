"""The optics in a real window: pad, loops, tilt handles, aperture shapes, presets, undo; and what each edit costs."""

from __future__ import annotations

import dataclasses

import pytest

from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.gloss.settings import Gloss
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import FAR, NEAR, Driver
from viewer.model import lens, messages, preferences
from viewer.model.action import Action, do
from viewer.model.focal_plane import handle_points, sharp_disparity
from viewer.model.state.lens import TiltHandles
from viewer.model.state.notices import Notice


@pytest.fixture
def grid() -> GridShape:
    return GridShape(5, 5)


def test_the_pad_moves_the_viewpoint_as_far_as_there_are_views(viewer: Driver) -> None:
    x, y = viewer.find("pad")
    for step in (-200, 200):
        viewer.send("mousemove", x, y, "mousedown", 1)
        viewer.send("mousemove", x + step, y)
        end = 2.0 if step > 0 else -2.0
        viewer.until(lambda app, end=end: app.state.optics.eye.s == end)  # type: ignore[misc]
        viewer.send("mouseup", 1)
        viewer.until_idle()
    assert len(viewer.app.state.history.past) == 2


def test_a_loop_draws_while_it_runs_and_nothing_while_it_rests(viewer: Driver) -> None:
    app = viewer.app
    viewer.press("Circle")
    drawn = app.scene_view.pictures_drawn
    viewer.until(lambda app: app.scene_view.pictures_drawn >= drawn + 5)
    assert app.state.motion.is_running
    assert len({app.state.optics.eye, ViewOffset(0, 0)}) == 2
    viewer.send("key", "space")
    viewer.until(lambda app: app.state.motion.is_paused)
    viewer.until_idle()
    shown, drawn, eye = app.frames_shown, app.scene_view.pictures_drawn, app.state.optics.eye
    for _ in range(3):
        app.step()
    assert (app.frames_shown, app.scene_view.pictures_drawn, app.state.optics.eye) == (shown, drawn, eye)
    viewer.press("Circle")
    viewer.until(lambda app: app.state.motion.kind is None)


def test_a_double_click_glides_home_and_keeps_focus_and_aperture(viewer: Driver) -> None:
    from imgui_bundle import imgui

    io = imgui.get_io()  # a busy machine may draw for longer than the usual 0.3 s between the two clicks
    io.mouse_double_click_time, io.mouse_single_click_delay = 60.0, 61.0
    viewer.slide("##Aperture", 0.5)
    viewer.send("mousemove", *viewer.position(0.5, 0.5), "click", 1)
    viewer.until(lambda app: app.state.optics.focus_disparity != 0)
    kept = viewer.app.state.optics
    viewer.until_idle()
    viewer.send("key", "Right", "key", "Right")
    viewer.until(lambda app: app.state.optics.eye == ViewOffset(0, 1))
    viewer.send("mousemove", *viewer.position(0.1, 0.1), "click", "--repeat", 2, "--delay", 40, 1)
    viewer.until(lambda app: app.state.optics.eye == ViewOffset(0, 0))
    viewer.until_idle()
    assert viewer.app.state.optics == kept


def test_a_tilt_handle_is_dragged_onto_what_shall_be_sharp(viewer: Driver) -> None:
    scene = viewer.app.state.scene
    assert scene is not None
    assert scene.plan is not None
    viewer.send("key", "t")
    viewer.until(lambda app: app.state.tilt_handles is not None)
    picture = viewer.app.layout().picture
    assert picture is not None
    (x, y), _ = handle_points(TiltHandles(), picture)
    viewer.send("mousemove", round(x), round(y), "mousedown", 1)
    viewer.send("mousemove", round(x) + 20, round(y))
    viewer.send("mousemove", *viewer.position(0.5, 0.5))
    near = (NEAR - scene.plan.disparity_zero) * scene.plan.disparity_scale
    viewer.until(lambda app: sharp_disparity(app.state.optics, (0, 0)) == pytest.approx(near, abs=1e-3))
    viewer.send("mouseup", 1)
    viewer.until_idle()
    state = viewer.app.state
    assert state.optics.eye == ViewOffset(0, 0)
    assert any(state.optics.focus_tilt)
    assert sharp_disparity(state.optics, TiltHandles().second) == pytest.approx(0, abs=1e-3), "the other one held"
    viewer.send("key", "ctrl+z")
    viewer.until(lambda app: app.state.optics == Optics())


def test_the_aperture_takes_the_shape_that_was_chosen(viewer: Driver) -> None:
    viewer.slide("##Aperture", 0.9)
    viewer.press("##polygon")
    viewer.slide("##Blades", 0.0)
    viewer.slide("##Rotation", 0.5)
    shape = viewer.app.state.optics.aperture_shape
    assert (shape.kind, shape.blades) == ("polygon", 3)
    assert 100 < shape.rotation_deg < 260
    viewer.press("##ring")
    viewer.slide("##Blocked", 0.5)
    assert viewer.app.state.optics.aperture_shape.kind == "ring"


def test_presets_and_undo_by_button_and_key(viewer: Driver) -> None:
    viewer.press("Macro")
    viewer.until(lambda app: app.state.optics.aperture_diameter == 5)
    viewer.press("Portrait")
    viewer.until(lambda app: app.state.optics.focus_range > 0)
    viewer.send("key", "ctrl+z")
    viewer.until(lambda app: app.state.optics.aperture_diameter == 5)
    viewer.send("key", "ctrl+z")
    viewer.until(lambda app: app.state.optics == Optics())
    viewer.send("key", "ctrl+shift+z")
    viewer.until(lambda app: app.state.optics.aperture_diameter == 5)


def test_the_reticle_follows_the_pointer_and_costs_no_picture(viewer: Driver) -> None:
    app = viewer.app
    scene = app.state.scene
    assert scene is not None
    assert scene.plan is not None
    drawn = app.scene_view.pictures_drawn
    for place, given in (((0.5, 0.5), NEAR), ((0.15, 0.15), FAR)):
        wanted = pytest.approx((given - scene.plan.disparity_zero) * scene.plan.disparity_scale, abs=1e-3)
        shown = app.frames_shown
        viewer.send("mousemove", *viewer.position(*place))
        viewer.until(lambda app, w=wanted: app.state.hover is not None and app.state.hover.disparity == w)  # type: ignore[misc]
        viewer.until_idle()
        assert app.frames_shown > shown
    viewer.send("mousemove", round(app.layout().panel.x + 20), 300)
    viewer.until(lambda app: app.state.hover is None)
    assert app.scene_view.pictures_drawn == drawn


DRAWS = (
    do(lens.set_dolly, 0.5),
    do(lens.set_focus_range, 0.3),
    do(lens.set_focus_tilt, (0.2, 0.1)),
    do(lens.set_aperture_shape, ApertureShape("polygon", blades=5)),
    do(lens.set_highlights, 0.5),
    do(lens.move_eye, ViewOffset(0.5, 0.5)),
    do(lens.set_gloss, Gloss()),
    do(lens.apply_preset, "portrait"),
)
ONLY_PANELS = (
    do(lens.show_tilt_handles, True),
    do(messages.notify, Notice("hello")),
    do(messages.show_prompt, "help"),
    do(preferences.set_theme, "light"),
    do(lens.show_tilt_handles, False),
)


def test_what_each_edit_rebuilds(viewer: Driver, monkeypatch: pytest.MonkeyPatch) -> None:
    """Optics draw the picture and nothing else; panels draw panels; only depth strength makes the views again."""
    app = viewer.app
    uploads = count_calls(monkeypatch, app.scene_view.renderer, "upload_view")

    def cost_of(action: Action) -> tuple[bool, bool, bool, bool]:
        before = app.scene_view.pictures_drawn, app.frames_shown, len(uploads), app.scene_view.generation
        app.do(action)
        viewer.until(lambda app: app.scene_view.generation == app.state.generation)
        viewer.until_idle()
        after = app.scene_view.pictures_drawn, app.frames_shown, len(uploads), app.scene_view.generation
        drawn, shown, uploaded, generation = (a != b for a, b in zip(before, after))
        return drawn, shown, uploaded, generation

    for action in DRAWS:
        assert cost_of(action) == (True, True, False, False), action
    for action in ONLY_PANELS:
        assert cost_of(action) == (False, True, False, False), action
    assert cost_of(DRAWS[-1]) == (False, False, False, False), "the same again"
    assert cost_of(do(lens.set_depth_strength, 2.0, is_finished=False)) == (False, True, False, False), (
        "its slider moves"
    )
    assert cost_of(do(lens.set_depth_strength, 2.0, is_finished=True)) == (True, True, True, True)
    assert cost_of(do(preferences.set_font_scale, 1.3))[2:] == (False, False)


def count_calls(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> list[object]:
    """A list that grows with every call of this method, which still does what it did."""
    calls: list[object] = []
    original = getattr(owner, name)

    def counted(*args: object, **kwargs: object) -> object:
        calls.append(args[:2])
        return original(*args, **kwargs)

    monkeypatch.setattr(owner, name, counted)
    return calls


def test_optics_name_every_field_that_an_edit_can_change() -> None:
    """So that a new field is not forgotten in DRAWS: each edit above changes other fields than the rest."""
    assert {field.name for field in dataclasses.fields(Optics)} == {
        "eye",
        "dolly",
        "focus_disparity",
        "focus_range",
        "focus_tilt",
        "aperture_diameter",
        "aperture_shape",
        "highlight_recovery",
        "exposure_stops",
        "gloss",
    }
