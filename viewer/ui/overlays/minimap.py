"""The small picture in a corner while the picture is zoomed: the visible part and the scale."""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.model.layout import Layout
from viewer.ui.style import DARK, corners, pack_color


def draw_minimap(layout: Layout, texture: int) -> None:
    """Draw the small picture. texture: GL name of the whole picture, row 0 first. Colours do not follow the theme."""
    at, picture, frame, draw = layout.minimap, layout.picture, layout.frame, imgui.get_background_draw_list()
    if at is None or picture is None or frame is None:
        return
    scale, (near, far) = layout.ui_scale, corners(at)
    draw.add_image(imgui.ImTextureRef(texture), near, far)
    draw.add_rect(near, far, pack_color((0, 0, 0, 1), 0.7), 0, scale)
    left = at.x + (frame.x - picture.x) / picture.width * at.width
    top = at.y + (frame.y - picture.y) / picture.height * at.height
    right = left + frame.width / picture.width * at.width
    bottom = top + frame.height / picture.height * at.height
    draw.add_rect(imgui.ImVec2(left, top), imgui.ImVec2(right, bottom), pack_color((0, 0, 0, 1), 0.6), 0, 3.5 * scale)
    draw.add_rect(imgui.ImVec2(left, top), imgui.ImVec2(right, bottom), pack_color(DARK.text), 0, 1.5 * scale)
    words = f"{100 * layout.scale:.0f} %"
    size, room = imgui.calc_text_size(words), 4 * scale
    corner = imgui.ImVec2(far.x - size.x - 2 * room, at.y - size.y - 2 * room)
    draw.add_rect_filled(corner, imgui.ImVec2(far.x, at.y - room), pack_color(DARK.background, 0.72), 4 * scale)
    draw.add_text(imgui.ImVec2(corner.x + room, corner.y + room / 2), pack_color(DARK.text), words)
