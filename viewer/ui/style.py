"""Style of the panels: fonts, spacing, and one accent colour on grey, dark or light."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from viewer.model.layout import BACKGROUND
from viewer.model.preferences import Theme

FONT_SIZE = 16.0
WORDS_ROOM = 5.0
"""Margin of words over the picture, in window units at usual size."""
Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Palette:
    """Colours of a theme, sRGB. background: around the picture. warning: for inpainted content."""

    background: Color
    panel: Color
    frame: Color
    frame_hovered: Color
    text: Color
    quiet: Color
    accent: Color
    accent_dim: Color
    error: Color
    warning: Color
    selected: Color


DARK = Palette(
    background=BACKGROUND,
    panel=(0.115, 0.12, 0.13, 1.0),
    frame=(0.19, 0.20, 0.215, 1.0),
    frame_hovered=(0.24, 0.25, 0.27, 1.0),
    text=(0.90, 0.90, 0.90, 1.0),
    quiet=(0.62, 0.63, 0.65, 1.0),
    accent=(0.36, 0.60, 0.72, 1.0),
    accent_dim=(0.22, 0.42, 0.52, 1.0),
    error=(0.96, 0.55, 0.45, 1.0),
    warning=(0.93, 0.72, 0.38, 1.0),
    selected=(0.20, 0.36, 0.44, 1.0),
)
LIGHT = Palette(
    background=(0.80, 0.80, 0.81, 1.0),
    panel=(0.945, 0.945, 0.95, 1.0),
    frame=(0.86, 0.865, 0.875, 1.0),
    frame_hovered=(0.81, 0.82, 0.835, 1.0),
    text=(0.13, 0.14, 0.15, 1.0),
    quiet=(0.32, 0.33, 0.35, 1.0),
    accent=(0.12, 0.45, 0.60, 1.0),
    accent_dim=(0.45, 0.68, 0.79, 1.0),
    error=(0.72, 0.18, 0.10, 1.0),
    warning=(0.60, 0.36, 0.02, 1.0),
    selected=(0.68, 0.82, 0.89, 1.0),
)


@dataclass(frozen=True)
class Look:
    """Scale of every length (HiDPI, font scale), and the theme."""

    ui_scale: float = 1.0
    theme: Theme = "dark"


def palette_of(theme: Theme) -> Palette:
    """Return the colours of a theme."""
    return LIGHT if theme == "light" else DARK


def pack_color(color: Color, alpha: float = 1.0) -> int:
    """Return a colour for draw lists."""
    return int(imgui.get_color_u32(imgui.ImVec4(color[0], color[1], color[2], color[3] * alpha)))


def corners(rect: Rect) -> tuple[imgui.ImVec2, imgui.ImVec2]:
    """Return the upper left and the lower right corner."""
    return imgui.ImVec2(rect.x, rect.y), imgui.ImVec2(rect.x + rect.width, rect.y + rect.height)


def draw_words(words: str, x: float, y: float, scale: float, align: float = 0.0) -> None:
    """Draw words on a dark ground, legible over any photo. align: 0 begins at x, 1 ends there."""
    draw, size, room = imgui.get_background_draw_list(), imgui.calc_text_size(words), WORDS_ROOM * scale
    left = x - align * (size.x + 2 * room)
    far = imgui.ImVec2(left + size.x + 2 * room, y + size.y + room)
    draw.add_rect_filled(imgui.ImVec2(left, y), far, pack_color(DARK.background, 0.72), 4 * scale)
    draw.add_text(imgui.ImVec2(left + room, y + room / 2), pack_color(DARK.text), words)


def load_fonts() -> None:
    """Load the fonts of text and icons; ImGui's bitmap font stays if the bundle lacks them."""
    folder = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
    font, icons = folder / "Roboto" / "Roboto-Regular.ttf", folder / "Font_Awesome_6_Free-Solid-900.otf"
    fonts = imgui.get_io().fonts
    if font.is_file():
        fonts.add_font_from_file_ttf(str(font), FONT_SIZE)
    if font.is_file() and icons.is_file():
        merged = imgui.ImFontConfig()
        merged.merge_mode = True
        merged.glyph_offset = imgui.ImVec2(0, 1)
        fonts.add_font_from_file_ttf(str(icons), 0.85 * FONT_SIZE, merged)


def apply_style(look: Look) -> None:
    """Set colours and sizes; may be called again between frames."""
    (imgui.style_colors_light if look.theme == "light" else imgui.style_colors_dark)()
    style, scale = imgui.get_style(), look.ui_scale

    def pair(x: float, y: float) -> imgui.ImVec2:
        return imgui.ImVec2(round(x * scale), round(y * scale))

    style.window_padding, style.frame_padding = pair(14, 12), pair(8, 4)
    style.item_spacing, style.item_inner_spacing = pair(8, 6), pair(6, 4)
    style.window_border_size = style.popup_border_size = 0
    style.window_rounding = style.frame_rounding = style.grab_rounding = style.popup_rounding = round(4 * scale)
    style.grab_min_size = style.scrollbar_size = round(10 * scale)
    style.indent_spacing = round(12 * scale)
    style.font_size_base, style.font_scale_dpi = FONT_SIZE, scale
    for color, value in _colors(palette_of(look.theme)).items():
        style.set_color_(color, imgui.ImVec4(*value))


def _colors(palette: Palette) -> dict[int, Color]:
    c = imgui.Col_
    clear = (0.0, 0.0, 0.0, 0.0)
    return {
        c.text: palette.text,
        c.text_disabled: palette.quiet,
        c.window_bg: palette.panel,
        c.popup_bg: palette.frame,
        c.frame_bg: palette.frame,
        c.frame_bg_hovered: palette.frame_hovered,
        c.frame_bg_active: palette.frame_hovered,
        c.check_mark: palette.accent,
        c.slider_grab: palette.accent_dim,
        c.slider_grab_active: palette.accent_dim,
        c.plot_histogram: palette.accent,
        c.button: palette.frame,
        c.button_hovered: palette.frame_hovered,
        c.button_active: palette.accent_dim,
        c.header: palette.selected,
        c.header_hovered: palette.accent_dim,  # differs from the frame's colour, on which lists lie
        c.header_active: palette.accent_dim,
        c.separator: palette.frame,
        c.scrollbar_bg: clear,
        c.scrollbar_grab: palette.frame_hovered,
    }
