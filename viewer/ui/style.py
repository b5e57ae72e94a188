"""How the panels look: fonts, spacing and one accent colour on dark grey."""

from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

FONT_SIZE = 16.0
BACKGROUND = (0.07, 0.07, 0.08, 1.0)
"""Around the picture, sRGB."""

ACCENT = (0.36, 0.60, 0.72, 1.0)
ACCENT_DIM = (0.22, 0.42, 0.52, 1.0)
"""Under white text."""
TEXT = (0.90, 0.90, 0.90, 1.0)
QUIET_TEXT = (0.62, 0.63, 0.65, 1.0)
ERROR_TEXT = (0.96, 0.55, 0.45, 1.0)
PANEL = (0.115, 0.12, 0.13, 1.0)
FRAME = (0.19, 0.20, 0.215, 1.0)
FRAME_HOVERED = (0.24, 0.25, 0.27, 1.0)


def load_fonts() -> None:
    """Give ImGui a readable sans serif; its own bitmap font stays where the bundle comes without one."""
    font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    if font.is_file():
        imgui.get_io().fonts.add_font_from_file_ttf(str(font), FONT_SIZE)


def apply_style(ui_scale: float) -> None:
    """Set colours and sizes. ui_scale multiplies every length (HiDPI)."""
    imgui.style_colors_dark()
    style = imgui.get_style()
    style.window_padding = imgui.ImVec2(14, 14)
    style.frame_padding = imgui.ImVec2(8, 4)
    style.item_spacing = imgui.ImVec2(8, 7)
    style.window_border_size = 0
    style.window_rounding = style.frame_rounding = style.grab_rounding = 4
    style.grab_min_size = 10
    style.scrollbar_size = 10
    style.font_size_base = FONT_SIZE
    style.font_scale_dpi = ui_scale
    style.scale_all_sizes(ui_scale)
    for color, value in _colors().items():
        style.set_color_(color, imgui.ImVec4(*value))


def _colors() -> dict[int, tuple[float, float, float, float]]:
    c = imgui.Col_
    return {
        c.text: TEXT,
        c.window_bg: PANEL,
        c.frame_bg: FRAME,
        c.frame_bg_hovered: FRAME_HOVERED,
        c.frame_bg_active: FRAME_HOVERED,
        c.slider_grab: ACCENT_DIM,
        c.slider_grab_active: ACCENT,
        c.plot_histogram: ACCENT,
        c.button: FRAME,
        c.button_hovered: FRAME_HOVERED,
        c.button_active: ACCENT,
        c.separator: FRAME,
    }
