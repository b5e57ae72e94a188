"""The panel without a window: what it shows, and what a person does to it. The widgets are ImGui's own, watched."""

from dataclasses import dataclass
from typing import Any

import pytest
from imgui_bundle import imgui

from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.conftest import headless_with_scene, reduce
from viewer.gpu.context import create_headless
from viewer.model.window import layout_for
from viewer.ui.host import UiHost
from viewer.ui.screen import build_screen
from viewer.ui.style import Look

BUTTONS = ("button", "small_button", "invisible_button")
PRESSED = (*BUTTONS, "tree_node_ex")
SLIDERS = ("slider_float", "slider_int")
WORDS_INSIDE = ("button", "small_button", *SLIDERS, "begin_combo")
CONTROLS = (
    *WORDS_INSIDE, "invisible_button", "checkbox", "selectable", "tree_node_ex", "input_int", "input_float",
    "input_text_with_hint", "color_edit3",
)  # fmt: skip
WORDS = ("text", "text_disabled", "text_wrapped")
WINDOW = ScreenSize(1280, 800)


@dataclass(frozen=True)
class Item:
    """A widget as it was laid out. words: drawn in it, on one line. ends: of a slider."""

    kind: str
    window: str
    name: str
    words: str
    value: Any
    ends: Any
    left: float
    top: float
    right: float
    bottom: float
    words_width: float


class Built(list[Item]):
    """The widgets of the last frame. answers: what a person does to widgets, by name."""

    def __init__(self):
        self.answers, self.is_last_answered, self.opened = {}, False, []

    def add(self, kind, arguments):
        """Note the widget that was built last."""
        low, high, words = imgui.get_item_rect_min(), imgui.get_item_rect_max(), words_of(kind, arguments)
        window, width = imgui.internal.get_current_window_read().name, imgui.calc_text_size(words).x
        value, ends = arguments[1] if len(arguments) > 1 else None, arguments[2:4]
        self.append(Item(kind, window, str(arguments[0]), words, value, ends, low.x, low.y, high.x, high.y, width))

    def names(self, *kinds, window="panel"):
        """Return the names of the widgets of these kinds in a window."""
        return [item.name for item in self if item.kind in kinds and item.window == window]

    def said(self):
        """Return the sentences of the panel."""
        return self.names("text_wrapped")


def words_of(kind, arguments):
    if kind in SLIDERS:
        value, form = arguments[1], arguments[4] if len(arguments) > 4 else "%d"
        return str(form % value if form.replace("%%", "").count("%") else form.replace("%%", "%"))
    return str(arguments[1] if kind == "begin_combo" else arguments[0]).partition("##")[0]


@pytest.fixture
def built(monkeypatch):
    """Every widget of the last frame, in windows of whatever name."""
    found = Built()

    def watched(kind, real):
        def build(*arguments):
            found.is_last_answered = arguments[0] in found.answers
            if kind == "begin_combo" and found.is_last_answered:
                found.opened.append(arguments[0])
                return True
            result = real(*arguments)
            found.add(kind, arguments)
            if not found.is_last_answered:
                return result
            if kind == "checkbox":
                return True, not arguments[1]
            return not result if kind in PRESSED else (True, found.answers[arguments[0]])

        return build

    for kind in (*CONTROLS, *WORDS):
        monkeypatch.setattr(imgui, kind, watched(kind, getattr(imgui, kind)))
    new_frame, end_combo, has_ended = imgui.new_frame, imgui.end_combo, imgui.is_item_deactivated_after_edit
    monkeypatch.setattr(imgui, "new_frame", lambda: (found.clear(), new_frame()))
    monkeypatch.setattr(imgui, "end_combo", lambda: found.opened.pop() if found.opened else end_combo())
    monkeypatch.setattr(imgui, "is_item_deactivated_after_edit", lambda: found.is_last_answered or has_ended())
    return found


@pytest.fixture(scope="module")
def gl():
    context = create_headless()
    yield context
    context.release()


@pytest.fixture
def operated(gl, built):
    """Return the state after a person gave widgets of the screen these values; True presses a button or a box."""

    def operate(state, **answers):
        built.answers = answers
        return after_frames(state, WINDOW)

    return operate


def after_frames(state, size, frames=1, before_frame=lambda frame: None):
    """Return the state after what a screen of it asks for in the last frame. before_frame: called with its number."""
    ui, layout = UiHost(Look()), layout_for(state, size, 1.0, 1.0)
    try:
        for frame in range(frames):
            before_frame(frame)
            ui.begin(layout, Look())
            actions = build_screen(state, layout, None)
            ui.end()
    finally:
        ui.release()
    for action in actions:
        state = reduce(state, action)
    return state


@pytest.fixture(scope="module")
def opened(request, tmp_path_factory):
    """A scene without a window. OPEN_SECTIONS of the module: of the panel, those that are used most if none."""
    with headless_with_scene(tmp_path_factory.mktemp("ui"), *getattr(request.module, "OPEN_SECTIONS", ())) as viewer:
        yield viewer
