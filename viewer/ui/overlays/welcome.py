"""The card in an empty window: drop a photo, open one, or see the demo."""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.model.action import Action
from viewer.model.commands import BY_NAME
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.ui.overlays.prompt_rows import CARD_FLAGS, button_rows
from viewer.ui.panel import progress_text
from viewer.ui.widgets import gap, quiet

WIDTH = 300.0
OFFERS = ("Open a photo…", "See the demo")
"""Names of the commands that the card offers."""


def welcome(state: AppState, layout: Layout) -> list[Action]:
    """Build the card where the picture will be, while nothing is open or being read and no prompt is shown."""
    if state.scene is not None or progress_text(state.progress) or state.prompt is not None:
        return []
    width = min(WIDTH * layout.ui_scale, layout.window.width)
    middle = imgui.ImVec2(max(layout.panel.x, width) / 2, layout.window.height / 2)
    imgui.set_next_window_pos(middle, 0, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size(imgui.ImVec2(width, 0))
    imgui.begin("welcome", None, CARD_FLAGS)
    imgui.text_wrapped("Drop a photo here")
    quiet("or a folder of photos, or a light field.")
    gap()
    actions = button_rows([(name, BY_NAME[name].action(state)) for name in OFFERS])
    imgui.end()
    return actions
