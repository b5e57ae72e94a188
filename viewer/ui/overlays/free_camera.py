"""The chip in the picture's corner that says that a free camera draws it, and goes back when pressed."""

from __future__ import annotations

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from viewer.model.actions import Action
from viewer.model.free_camera import LeaveCamera, is_at_end
from viewer.model.layout import Layout
from viewer.model.lens.photographic_units import mean_depth
from viewer.model.state.app_state import AppState
from viewer.ui.style import DARK

CHIP = "free camera"
FULL, SHORT = "Free camera: off the plane of views. C returns", "Free camera. C returns"
AT_END = "The photo ends here. C returns"
_BARE = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_background
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_nav
    | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.always_auto_resize
)


def free_camera_chip(state: AppState, layout: Layout) -> list[Action]:
    """In the picture's upper right corner; nothing on the plane of the views. Its colours are those of overlays."""
    camera, scene, frame = state.free_camera, state.scene, layout.frame
    if camera is None or scene is None or frame is None or state.inspection.shows_grid:
        return []
    gap = 8 * layout.ui_scale
    imgui.set_next_window_pos(imgui.ImVec2(frame.x + frame.width - gap, frame.y + gap), 0, imgui.ImVec2(1, 0))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    imgui.begin(CHIP, None, _BARE)
    words = AT_END if is_at_end(camera, mean_depth(scene)) else FULL
    if imgui.calc_text_size(words).x + 6 * gap > frame.width:
        words = SHORT
    colors = {imgui.Col_.button: (*DARK.background[:3], 0.85), imgui.Col_.button_hovered: DARK.frame_hovered}
    for which, color in (colors | {imgui.Col_.text: DARK.warning}).items():
        imgui.push_style_color(which, imgui.ImVec4(*color))
    pressed = imgui.button(f"{icons.ICON_FA_VIDEO}  {words}###leave")
    imgui.pop_style_color(3)
    imgui.end()
    imgui.pop_style_var()
    return [LeaveCamera()] if pressed else []
