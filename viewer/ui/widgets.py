"""The few widgets the panel is made of, all in one rhythm: a label at the left, the control beside it, a tooltip."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TypeVar

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from viewer.model.layout import Layout

Item = TypeVar("Item")
LABEL_WIDTH = 104.0
GRIP_WIDTH, GRIP_HEIGHT = 12.0, 4.0
TOOLTIP_WIDTH = 260.0


def label(text: str, layout: Layout, tip: str = "") -> None:
    """A row's label; what comes next stands beside it."""
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    tooltip(tip, layout)
    imgui.same_line(LABEL_WIDTH * layout.ui_scale + imgui.get_style().window_padding.x)
    imgui.set_next_item_width(-1)


def slider(
    text: str,
    value: float,
    limits: tuple[float, float],
    form: str,
    layout: Layout,
    tip: str = "",
    is_logarithmic: bool = False,
    is_enabled: bool = True,
) -> float | None:
    """A row with a slider; the new value where the user changed it. form: printf-like. Ctrl+click types a value."""
    imgui.begin_disabled(not is_enabled)
    label(text, layout, tip)
    flags = imgui.SliderFlags_.always_clamp | (imgui.SliderFlags_.logarithmic if is_logarithmic else 0)
    changed, new = imgui.slider_float(f"##{text}", value, *limits, form, flags)
    ends = tuple(map(math.log, (new, *limits))) if is_logarithmic else (new, *limits)
    _draw_grip(ends, layout)
    imgui.end_disabled()
    tooltip(tip, layout)
    return new if changed else None


def percent_slider(text: str, share: float, layout: Layout, tip: str, is_enabled: bool = True) -> float | None:
    """A row with a slider over shares, 0..1, shown in per cent."""
    percent = slider(text, 100 * share, (0.0, 100.0), "%.0f %%", layout, tip, is_enabled=is_enabled)
    return None if percent is None else percent / 100


def end_words(left: str, right: str, layout: Layout) -> None:
    """Quiet words at the ends of the last slider."""
    corner, far = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    padding = imgui.get_style().frame_padding
    draw, color = imgui.get_window_draw_list(), imgui.get_color_u32(imgui.Col_.text_disabled)
    draw.add_text(imgui.ImVec2(corner.x + padding.x, corner.y + padding.y), color, left)
    x = far.x - padding.x - imgui.calc_text_size(right).x
    draw.add_text(imgui.ImVec2(x, corner.y + padding.y), color, right)


def whole_slider(
    text: str, value: int, limits: tuple[int, int], layout: Layout, tip: str = "", is_enabled: bool = True
) -> int | None:
    """A row with a slider over whole numbers."""
    imgui.begin_disabled(not is_enabled)
    label(text, layout, tip)
    changed, new = imgui.slider_int(f"##{text}", value, *limits, "%d", imgui.SliderFlags_.always_clamp)
    _draw_grip((new, *limits), layout)
    imgui.end_disabled()
    tooltip(tip, layout)
    return new if changed else None


def _draw_grip(value_and_limits: tuple[float, ...], layout: Layout) -> None:
    """A line below the value of the last slider as far as it goes, and a grip at its end: it covers no words."""
    value, low, high = value_and_limits
    corner, far = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    share = min(max((value - low) / (high - low), 0.0), 1.0) if high > low else 0.0
    grip, thick = GRIP_WIDTH * layout.ui_scale, GRIP_HEIGHT * layout.ui_scale
    x = corner.x + share * (far.x - corner.x - grip)
    is_held = imgui.is_item_active() or imgui.is_item_hovered()
    color = imgui.get_color_u32(imgui.Col_.check_mark if is_held else imgui.Col_.button_active)
    draw = imgui.get_window_draw_list()
    draw.add_rect_filled(imgui.ImVec2(corner.x, far.y - thick / 2), imgui.ImVec2(x, far.y), color)
    draw.add_rect_filled(imgui.ImVec2(x, far.y - thick), imgui.ImVec2(x + grip, far.y), color, thick / 2)


def checkbox(text: str, is_on: bool, layout: Layout, tip: str = "") -> bool | None:
    """A box to tick; the new value where the user changed it."""
    changed, new = imgui.checkbox(text, is_on)
    tooltip(tip, layout)
    return new if changed else None


def button(text: str, layout: Layout, tip: str = "", is_enabled: bool = True, width: float = 0.0) -> bool:
    """A button; True when it was pressed."""
    imgui.begin_disabled(not is_enabled)
    pressed = imgui.button(text, imgui.ImVec2(width, 0))
    imgui.end_disabled()
    tooltip(tip, layout)
    return bool(pressed)


def choice(text: str, is_chosen: bool, layout: Layout, size: tuple[float, float], tip: str = "") -> bool:
    """A button that stays lit while it is chosen; True when it was pressed."""
    if is_chosen:
        for color in (imgui.Col_.button, imgui.Col_.button_hovered):
            imgui.push_style_color(color, imgui.get_style().color_(imgui.Col_.button_active))
    pressed = imgui.button(text, imgui.ImVec2(*size))
    if is_chosen:
        imgui.pop_style_color(2)
    tooltip(tip, layout)
    return bool(pressed)


def combo(name: str, shown: str, entries: Sequence[tuple[str, str]], layout: Layout, tip: str = "") -> int | None:
    """A list that opens: (words, what they mean) of each entry; the index of the one that was picked. While the
    pointer rests on an entry, what it means stands beside it. shown: words of the chosen entry.
    """
    picked = None
    if imgui.begin_combo(f"##{name}", shown, imgui.ComboFlags_.height_large):
        for i, (words, meaning) in enumerate(entries):
            if imgui.selectable(words, words == shown)[0]:
                picked = i
            tooltip(meaning, layout)
        imgui.end_combo()
    else:
        tooltip(tip, layout)
    return picked


def heading(text: str, is_open: bool, layout: Layout) -> bool:
    """A section's heading over the whole width; True when it was pressed, to open or close the section."""
    icon = icons.ICON_FA_CHEVRON_DOWN if is_open else icons.ICON_FA_CHEVRON_RIGHT
    style = imgui.get_style()
    corner = imgui.get_cursor_screen_pos()
    width, height = imgui.get_content_region_avail().x, imgui.get_frame_height()
    pressed = imgui.invisible_button(f"section {text}", imgui.ImVec2(width, height))
    draw = imgui.get_window_draw_list()
    if imgui.is_item_hovered():
        far = imgui.ImVec2(corner.x + width, corner.y + height)
        draw.add_rect_filled(corner, far, imgui.get_color_u32(imgui.Col_.frame_bg), style.frame_rounding)
    y = corner.y + style.frame_padding.y
    small, middle = 0.65 * imgui.get_font_size(), 0.2 * imgui.get_font_size()
    quiet_color = imgui.get_color_u32(imgui.Col_.text_disabled)
    draw.add_text(imgui.get_font(), small, imgui.ImVec2(corner.x, y + middle), quiet_color, icon)
    indent = round(20 * layout.ui_scale)
    draw.add_text(imgui.ImVec2(corner.x + indent, y), imgui.get_color_u32(imgui.Col_.text), text)
    return bool(pressed)


def in_row(items: Sequence[Item], layout: Layout, a_row: int = 0) -> Iterator[tuple[Item, float]]:
    """Each with its width, side by side over the whole width; a_row: so many at the most, 0: all of them."""
    count, spacing = a_row or len(items), 4 * layout.ui_scale
    width = (imgui.get_content_region_avail().x - spacing * (count - 1)) / count
    for i, item in enumerate(items):
        if i % count:
            imgui.same_line(0, spacing)
        yield item, width


def quiet(text: str) -> None:
    """Words that do not ask for attention."""
    colored(text, imgui.get_style().color_(imgui.Col_.text_disabled))


def colored(text: str, color: imgui.ImVec4) -> None:
    """Words in a colour, on as many lines as they need."""
    imgui.push_style_color(imgui.Col_.text, color)
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def gap(layout: Layout, units: float = 4.0) -> None:
    """A little room."""
    imgui.dummy(imgui.ImVec2(0, units * layout.ui_scale))


def tooltip(text: str, layout: Layout) -> None:
    """Words that come up while the pointer rests on the last item, beside the panel or below the prompt that it is in:
    they must not hide its widgets.
    """
    if text and imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled):
        corner, pivot = _place_beside_panel(layout) if _is_in_panel(layout) else _place_below_window(layout)
        imgui.set_next_window_pos(corner, 0, pivot)
        imgui.begin_tooltip()
        imgui.push_text_wrap_pos(TOOLTIP_WIDTH * layout.ui_scale)
        imgui.text(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def _is_in_panel(layout: Layout) -> bool:
    return bool(imgui.get_window_pos().x >= layout.panel.x)


def _place_beside_panel(layout: Layout) -> tuple[imgui.ImVec2, imgui.ImVec2]:
    """As high as the last item; (where, which of the tooltip's corners, as shares of it)."""
    is_low = imgui.get_item_rect_max().y > 0.75 * layout.window.height
    y = imgui.get_item_rect_max().y if is_low else imgui.get_item_rect_min().y
    corner = imgui.ImVec2(layout.panel.x - 4 * layout.ui_scale, min(y, layout.window.height))
    return corner, imgui.ImVec2(1, 1 if is_low else 0)


def _place_below_window(layout: Layout) -> tuple[imgui.ImVec2, imgui.ImVec2]:
    """Under the last item; above the window where there is more room."""
    room = layout.window.width - TOOLTIP_WIDTH * layout.ui_scale - 2 * imgui.get_style().window_padding.x
    position, x = imgui.get_window_pos(), min(imgui.get_item_rect_min().x, room)
    bottom, space = position.y + imgui.get_window_height(), 4 * layout.ui_scale
    if layout.window.height - bottom < position.y:
        return imgui.ImVec2(x, position.y - space), imgui.ImVec2(0, 1)
    return imgui.ImVec2(x, bottom + space), imgui.ImVec2(0, 0)


def last_part(path: str) -> str:
    """Name of a file or folder, without those above it; of any system's paths."""
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2] or path
