"""Chips in the picture's corners (free camera, guessed depth), and the handle that shows a hidden panel."""

from __future__ import annotations

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from viewer.model import depth_models, tracking, viewpoint, window
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.layout import Layout
from viewer.ui.overlays.prompt_rows import CARD_FLAGS
from viewer.ui.style import DARK, draw_words
from viewer.ui.widgets import scale, tooltip

CHIP, BADGE, DRAFT = "free camera", "Depth guessed", "Draft"
FULL, SHORT = "Free camera: the photo does not show all of this. C returns", "Free camera. C returns"
FOLLOWING = "Follows the head. H stops it"
AT_END = "The photo shows nothing beyond this. C returns"
GUESS_TIP = "Depth is guessed, so near and far may be wrong. Press to get better depth."
GAP = 8.0
HANDLE, HANDLE_SIZE = "panel handle", (22.0, 56.0)
_BARE = CARD_FLAGS | imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_background


def chips(state: AppState, layout: Layout) -> list[Action]:
    """Build the chip of the free camera at the right, which leaves it, or that of guessed depth at the left, which
    offers better depth; a coarse picture has a mark at the other side.
    """
    frame, camera = layout.frame, state.free_camera
    if frame is None or state.scene is None or state.inspection.shows_views or state.shows_before:
        return []
    if state.report is not None and state.report.is_draft:
        is_right, gap = camera is None, GAP * scale()
        draw_words(DRAFT, frame.x + (frame.width - gap if is_right else gap), frame.y + gap, scale(), float(is_right))
    if has_guess_badge(state, layout):
        return [do(depth_models.show_offer, True)] if _chip(BADGE, BADGE, frame, GUESS_TIP) else []
    if camera is None and state.tracking is not None:
        words = f"{icons.ICON_FA_VIDEO}  {FOLLOWING}###leave"
        return [do(tracking.switch, None)] if _chip(CHIP, words, frame, is_right=True) else []
    if camera is None:
        return []
    words = AT_END if camera.is_at_end else FULL
    if imgui.calc_text_size(words).x + 6 * GAP * scale() > frame.width:
        words = SHORT
    is_pressed = _chip(CHIP, f"{icons.ICON_FA_VIDEO}  {words}###leave", frame, is_right=True)
    return [do(viewpoint.leave_camera)] if is_pressed else []


def has_guess_badge(state: AppState, layout: Layout) -> bool:
    """Return whether the left upper corner has the chip of guessed depth."""
    scene, frame = state.scene, layout.frame
    if scene is None or frame is None or state.free_camera is not None or state.shows_before:
        return False
    return scene.is_guessed and imgui.calc_text_size(BADGE).x + 4 * GAP * layout.ui_scale <= frame.width


def panel_handle(state: AppState, layout: Layout) -> list[Action]:
    """Build the handle that shows and hides the panel where it covers much of the picture."""
    if not (state.is_panel_hidden or state.is_narrow):
        return []
    imgui.set_next_window_pos(imgui.ImVec2(layout.panel.x, layout.window.height / 2), 0, imgui.ImVec2(1, 0.5))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    imgui.begin(HANDLE, None, _BARE)
    icon = icons.ICON_FA_CHEVRON_LEFT if state.is_panel_hidden else icons.ICON_FA_CHEVRON_RIGHT
    width, height = (side * layout.ui_scale for side in HANDLE_SIZE)
    pressed = imgui.button(f"{icon}###panel", imgui.ImVec2(width, height))
    tooltip("Show the panel (Tab)" if state.is_panel_hidden else "Hide the panel (Tab)")
    imgui.end()
    imgui.pop_style_var()
    return [do(window.toggle_panel)] if pressed else []


def _chip(name: str, words: str, frame: Rect, tip: str = "", is_right: bool = False) -> bool:
    """Build a chip in colours that are legible over any photo; return whether it was pressed."""
    gap = GAP * scale()
    x = frame.x + frame.width - gap if is_right else frame.x + gap
    imgui.set_next_window_pos(imgui.ImVec2(x, frame.y + gap), 0, imgui.ImVec2(float(is_right), 0))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    imgui.begin(name, None, _BARE)
    colors = {imgui.Col_.button: (*DARK.background[:3], 0.85), imgui.Col_.button_hovered: DARK.frame_hovered}
    for which, color in (colors | {imgui.Col_.text: DARK.warning}).items():
        imgui.push_style_color(which, imgui.ImVec4(*color))
    pressed = imgui.button(words)
    imgui.pop_style_color(3)
    tooltip(tip)
    imgui.end()
    imgui.pop_style_var()
    return bool(pressed)
