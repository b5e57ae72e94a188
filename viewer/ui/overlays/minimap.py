"""The small picture in a corner while the picture is zoomed: the visible part and the scale."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from viewer.model.layout import Layout
from viewer.ui.style import DARK, corners, draw_words, pack_color


def draw_minimap(layout: Layout, texture: int) -> None:
    """Draw the small picture. texture: GL name of the whole picture, row 0 first. Colours do not follow the theme."""
    at, part, draw, scale = layout.minimap, layout.part, imgui.get_background_draw_list(), layout.ui_scale
    if at is None:
        return
    draw.add_image(imgui.ImTextureRef(texture), *corners(at))
    draw.add_rect(*corners(at), pack_color((0, 0, 0, 1), 0.7), 0, scale)
    x, y = at.x + part.x * at.width, at.y + part.y * at.height
    seen = corners(Rect(x, y, part.width * at.width, part.height * at.height))
    draw.add_rect(*seen, pack_color((0, 0, 0, 1), 0.6), 0, 3.5 * scale)
    draw.add_rect(*seen, pack_color(DARK.text), 0, 1.5 * scale)
    words, top = f"{100 * layout.scale:.0f} %", at.y - imgui.get_text_line_height() - 9 * scale
    draw_words(words, at.x + at.width, top, scale, align=1.0)
