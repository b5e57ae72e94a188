"""Each control of each screen, used once: what a person sets is what the state gets. Golden texts tell the changes."""

import math
from dataclasses import replace

import pytest
from imgui_bundle import imgui

from iibr_core.beyond.optics import ApertureShape
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.golden_text import assert_same_text
from tests.viewer.conftest import reduce
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from tests.viewer.model.told import EXACT, changes
from tests.viewer.ui.conftest import CONTROLS, SLIDERS, after_frames
from tests.viewer.ui.test_golden_screens import MODELS, SCREENS, SOURCE, TALL, prompt
from viewer.model import depth, inspection, lens, preferences, viewpoint
from viewer.model.action import do
from viewer.model.depth import Brush, DepthSample
from viewer.model.depth_models import ModelsPrompt
from viewer.model.lens import FIRST_GLOSS, GlossBrush
from viewer.model.preferences import SECTIONS, Preferences, with_sections
from viewer.model.saving import SavePrompt

NINE = GridShape(9, 9)
PLAN = replace(plan_of(NINE), reasons=("A reason.",))
SCENE = scene_of(NINE, plan=PLAN, focal_px=50.0)
SHARE = 0.3
"""Place to which sliders are dragged, as a share of their length."""
GIVEN = {"input_text_with_hint": "b", "input_int": 7, "input_float": 1.5, "color_edit3": (0.5, 0.25, 0.125)}
LEVEL = do(depth.set_brush, Brush("level", is_on=True, sample=DepthSample((0.5, 0.5), 1.0)))
IN_PIXELS = (
    do(preferences.set_units, "light field"), do(lens.set_focus_tilt, (0.4, -0.3)), do(inspection.compare, "photo"),
    do(lens.set_aperture_shape, ApertureShape("ring")), do(lens.set_gloss, FIRST_GLOSS), LEVEL,
    do(lens.paint_gloss, (0.5, 0.5), GlossBrush(), True), do(lens.set_focus, 1.5), do(viewpoint.set_loop, "circle"),
    do(depth.set_tone, DepthEdits(gamma=2.0), True), do(inspection.set_overlay, "disparity"),
)  # fmt: skip
JPEG_AFTER_PNG = SavePrompt("/photos/a.jpg", ScreenSize(96, 64), form=PictureFormat(16))
STATES = SCREENS | {
    "panel in pixels": (TALL, IN_PIXELS, {}),
    "save another kind": prompt(JPEG_AFTER_PNG),
    "another model": prompt(ModelsPrompt(1), models=MODELS),
}
LEFT_OUT = "history.last", "history.gesture"
"""Changes that a person does not see."""


def state_of(scene, *actions):
    """Return a state with every section of the panel open, after these actions."""
    opened = Preferences(open_sections=with_sections((), *SECTIONS), shows_filmstrip=True)
    state = replace(state_with(scene), preferences=opened, hides_panel=False)
    for action in actions:
        state = reduce(state, action)
    return state


def state_for(name):
    """Return the state of a screen on a scene without pixels."""
    size, actions, changed = STATES[name]
    state, changed = state_of(SCENE, *actions), dict(changed)
    scene = replace(SCENE, source=SOURCE, depth_origin=changed.pop("origin", None))
    return replace(replace(state, scene=scene, source=SOURCE, hides_panel=size != TALL), **changed)


def answer(item):
    """Return what a person gives a control."""
    if item.kind in SLIDERS:
        low, high = item.ends
        value = low + SHARE * (high - low)
        return round(value) if item.kind == "slider_int" else value
    return GIVEN.get(item.kind, True)


@pytest.mark.parametrize("name", STATES)
def test_each_control_does_what_it_says(operated, built, name, regenerate_golden):
    size, before, lines = STATES[name][0], state_for(name), []
    operated(before)
    for item in [item for item in built if item.kind in CONTROLS and (item.window != "panel" or size == TALL)]:
        given = {item.name: answer(item)}
        for entry, mark in entries_of(item, operated, built, before).items():
            after = operated(before, **given, **({entry: True} if entry else {}))
            lines.append(f"{item.window}: {item.name} {entry}{mark}{shown_by(item, operated, built, after)}".rstrip())
            lines += [f"    {line}" for line in changes(before, after) if not line.startswith(LEFT_OUT)]
    assert_same_text(lines, "screens/controls", name, regenerate_golden, *EXACT)


def entries_of(item, operated, built, state):
    """Return the entries of a list, and whether each is chosen, in words; "" for other controls."""
    if item.kind != "begin_combo":
        return {"": ""}
    closed = set(built.names("selectable", window=item.window))
    operated(state, **{item.name: True})
    entries = [one for one in built if (one.kind, one.window) == ("selectable", item.window) and one.name not in closed]
    return {entry.name: " (chosen)" if entry.value else "" for entry in entries}


def shown_by(item, operated, built, after):
    """Return what a slider shows afterwards, "" for other controls."""
    if item.kind not in SLIDERS:
        return ""
    operated(after)
    return f"shows {', '.join(now.words for now in built if (now.window, now.name) == (item.window, item.name))}"


def test_pads_follow_a_drag(gl, built):
    """The pad of the viewpoint has room for each view of an even grid; the light comes from where its ball is held."""
    state = state_of(replace(SCENE, grid=GridShape(4, 9)), *IN_PIXELS[:1], do(lens.set_gloss, FIRST_GLOSS))
    assert dragged(built, state, "pad", (0.5, 0.5)).optics.eye == pytest.approx(ViewOffset(-0.5, 0.0), abs=0.02)
    eye = dragged(built, state, "pad", (0.9, 0.4)).optics.eye
    assert 3.2 < eye.s < 4, "four views to the right lie a little inside the border"
    assert eye.t == pytest.approx(-0.5 - eye.s / 4, abs=0.06)
    for share, light in (((0.5, 0.5), (0, 0, -1)), ((0.8, 0.4), (0.6, -0.2, -math.sqrt(0.6)))):
        assert dragged(built, state, "light ball", share).optics.gloss.light.direction == pytest.approx(light, abs=0.02)


def dragged(built, state, name, share):
    """Return the state while a control is held at a place, as shares of its size."""

    def hold(frame):
        if frame:
            (item,) = [item for item in built if item.name == name]
            across, down = item.right - item.left, item.bottom - item.top
            imgui.get_io().add_mouse_pos_event(item.left + share[0] * across, item.top + share[1] * down)
        if frame == 2:
            imgui.get_io().add_mouse_button_event(0, True)

    return after_frames(state, TALL, 4, hold)


def test_the_distance_of_the_focus_is_relative_to_what_stays_still(operated):
    scene = replace(SCENE, plan=replace(PLAN, disparity_scale=0.5, disparity_zero=10.0))
    after = operated(state_of(scene, do(preferences.set_units, "light field")), **{"##Distance": 0.8})
    assert after.optics.focus_disparity == pytest.approx((10.0 / 0.8 - 10.0) * 0.5)
