"""Actions of the mouse and of Escape in every mode, over a picture that fits and a zoomed one beside its EPIs."""

from dataclasses import replace

import pytest

from iibr_core.types import ViewOffset
from tests.golden_text import assert_same_text
from tests.viewer.model.picture_stories import BRUSH, EMPTY, OPEN
from tests.viewer.model.told import EXACT, title
from viewer.app.keys import Keys, actions_from_keys
from viewer.app.pointer import Pointer, actions_from_hover, actions_from_pointer
from viewer.model import depth, inspection, lens, messages, selection, stereo, viewpoint, window
from viewer.model.action import do
from viewer.model.commands import PalettePrompt
from viewer.model.focal_plane import handle_points
from viewer.model.layout import Beside, Zoom, layout_of
from viewer.model.lens import FIRST_GLOSS, GlossBrush, TiltHandles

LAYOUTS = {
    "fits": layout_of((1100, 700), (60, 40), own_width=240),
    "zoomed": layout_of((1100, 700), (60, 40), 2.0, 1.25, Beside((4, 9), True), True, Zoom(12.0, (0.3, 0.6)), 240),
}
AWAY = do(lens.move_eye, ViewOffset(0.5, -1.25))
BRUSHED = (AWAY, do(depth.set_brush, BRUSH))
GLOSSY = do(lens.set_gloss, FIRST_GLOSS)
MODES = {
    "looking": (AWAY,), "handles": (AWAY, do(lens.show_tilt_handles, True)),
    "handle taken": (do(lens.move_tilt_handle, 1, (0.1, 0.2), 1.0),), "brush": BRUSHED,
    "stroke": (*BRUSHED, do(depth.paint, (0.4, 0.4))),
    "selecting": (AWAY, do(depth.set_brush, replace(BRUSH, tool="select")), do(selection.select, (0.2, 0.2))),
    "marking": (AWAY, GLOSSY, do(lens.take_gloss_brush, GlossBrush(is_on=True))),
    "comparing": (do(inspection.compare, "photo"), do(inspection.move_divider, 0.3)),
    "divider let go": (do(inspection.compare, "photo"), do(inspection.move_divider, 0.3), do(window.end_gesture)),
    "all views": (do(inspection.show_views, True),),
}  # fmt: skip
OTHER_MODES = {
    "before": (do(lens.show_before, True),),
    "overlay": (do(window.set_fullscreen, True), do(inspection.set_overlay, "entropy")),
    "full screen": (do(window.set_fullscreen, True),), "stereo": (do(stereo.show, True),),
    "free camera": (do(viewpoint.move_camera, 0.1),),
    "prompt": (do(messages.show_prompt, "help"), do(stereo.show, True)),
    "typing": (do(messages.show_prompt, PalettePrompt()),),
}  # fmt: skip
KEYS = (
    Keys(is_escape=True), Keys(ViewOffset(1.0, -1.0)),
    Keys(commands=("Take a snapshot", "Save the picture…", "Before and after")),
)  # fmt: skip
PLACES = {"inside": (0.3, 0.7), "at a handle": (0.26, 0.69), "at the divider": (0.305, 0.4), "on the map": (0.93, 0.9)}


def pointers(x, y):
    """Yield what a pointer does at a place of the window."""
    at = Pointer(x=x, y=y, pressed_x=x, pressed_y=y)
    moved = replace(at, x=x + 30, y=y - 12, drag_distance=32.0, step_x=7.0, step_y=-3.0)
    yield from {
        "press": replace(at, is_down=True, is_pressed=True), "click": replace(at, is_released=True, clicks=1),
        "double click": replace(at, is_released=True, clicks=2), "drag": replace(moved, is_down=True),
        "drag begins": replace(moved, is_down=True, becomes_drag=True),
        "quick drag": replace(moved, is_released=True, becomes_drag=True, clicks=1),
        "end of a drag": replace(moved, is_released=True, clicks=1), "a still drag": replace(moved, step_x=0, step_y=0),
        "wheel": replace(at, wheel=2.0), "Ctrl wheel": replace(at, wheel=-1.0, holds_ctrl=True),
        "Ctrl press": replace(at, is_down=True, is_pressed=True, holds_ctrl=True),
        "Ctrl drag": replace(moved, is_down=True, becomes_drag=True, holds_ctrl=True),
        "Ctrl click": replace(at, is_released=True, holds_ctrl=True, clicks=1), "pull": replace(moved, pulls=True),
        "over a panel": replace(moved, is_down=True, is_over_panel=True),
        "from elsewhere": replace(moved, is_down=True, pressed_x=1.0, pressed_y=1.0),
        "wheel elsewhere": replace(at, x=1.0, y=1.0, wheel=1.0),
        "a tremble": replace(moved, drag_distance=3.0, is_down=True),
    }.items()  # fmt: skip


def state_in(mode):
    state = OPEN
    for action in (MODES | OTHER_MODES)[mode]:
        state = action.apply(state)
    return state


def pick(x, y):
    return None if y > 38 else round(x, 6) / 20


@pytest.mark.parametrize("mode", MODES)
def test_the_mouse_asks_for_what_the_mode_says(mode, regenerate_golden):
    state, lines = state_in(mode), []
    for shape, layout in LAYOUTS.items():
        frame = layout.frame
        places = {name: (frame.x + x * frame.width, frame.y + y * frame.height) for name, (x, y) in PLACES.items()}
        x, y = handle_points(TiltHandles(), layout.picture)[0]

        places |= {"beside a handle": (x + 15.5, y), "beside the divider": (frame.x + 0.3 * frame.width + 9.0, y)}
        for place, at in places.items():
            for name, pointer in pointers(*at):
                asked = [*actions_from_pointer(pointer, layout, state, pick)]
                asked += actions_from_hover(pointer, layout, state, pick)
                lines += [f"{shape}, {place}, {name}: {', '.join(map(title, asked))}"] if asked else []
    assert_same_text(lines, "viewer/gestures", mode, regenerate_golden, *EXACT)


def test_keys_ask_for_what_the_mode_says(regenerate_golden):
    lines = []
    for mode in MODES | OTHER_MODES:
        asked = [", ".join(map(title, actions_from_keys(keys, state_in(mode)))) for keys in KEYS]
        lines += [f"{mode}:", *(f"    {name}: {actions}" for name, actions in zip(("Esc", "arrows", "keys"), asked))]
    assert_same_text(lines, "viewer/gestures", "keys", regenerate_golden, *EXACT)


def test_nothing_is_asked_for_where_nothing_is_open():
    for _, pointer in pointers(400.0, 300.0):
        layout = layout_of((1100, 700), None)
        assert actions_from_pointer(pointer, layout, EMPTY, pick) == []
        assert actions_from_hover(pointer, layout, EMPTY, pick) == []
