"""Widgets of the panel: a label at the left, the control beside it, and a tooltip."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TypeVar

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from viewer.model.layout import Layout

Item = TypeVar("Item")
LABEL_WIDTH = 104.0
"""Width of a row's label at usual size, in window units."""
GRIP_WIDTH, GRIP_HEIGHT = 12.0, 4.0
TOOLTIP_WIDTH = 260.0


def label(text: str, layout: Layout, tip: str = "") -> None:
    """Build a row's label; the next widget stands beside it."""
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
    """Build a row with a slider; return a new value. form: printf-like. Ctrl+click types a value."""
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
    """Build a row with a slider for a share, 0 to 1, shown in per cent; return a new value."""
    percent = slider(text, 100 * share, (0.0, 100.0), "%.0f %%", layout, tip, is_enabled=is_enabled)
    return None if percent is None else percent / 100


def end_words(left: str, right: str, layout: Layout) -> None:
    """Draw quiet words at the ends of the last slider."""
    corner, far = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    padding = imgui.get_style().frame_padding
    draw, color = imgui.get_window_draw_list(), imgui.get_color_u32(imgui.Col_.text_disabled)
    draw.add_text(imgui.ImVec2(corner.x + padding.x, corner.y + padding.y), color, left)
    x = far.x - padding.x - imgui.calc_text_size(right).x
    draw.add_text(imgui.ImVec2(x, corner.y + padding.y), color, right)


def whole_slider(
    text: str, value: int, limits: tuple[int, int], layout: Layout, tip: str = "", is_enabled: bool = True
) -> int | None:
    """Build a row with a slider for whole numbers; return a new value."""
    imgui.begin_disabled(not is_enabled)
    label(text, layout, tip)
    changed, new = imgui.slider_int(f"##{text}", value, *limits, "%d", imgui.SliderFlags_.always_clamp)
    _draw_grip((new, *limits), layout)
    imgui.end_disabled()
    tooltip(tip, layout)
    return new if changed else None


def _draw_grip(value_and_limits: tuple[float, ...], layout: Layout) -> None:
    """Draw a line below the value of the last slider and a grip at its end, which covers no words."""
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
    """Build a checkbox; return a new value."""
    changed, new = imgui.checkbox(text, is_on)
    tooltip(tip, layout)
    return new if changed else None


def button(text: str, layout: Layout, tip: str = "", is_enabled: bool = True, width: float = 0.0) -> bool:
    """Build a button; return whether it was pressed."""
    imgui.begin_disabled(not is_enabled)
    pressed = imgui.button(text, imgui.ImVec2(width, 0))
    imgui.end_disabled()
    tooltip(tip, layout)
    return bool(pressed)


def choice(text: str, is_chosen: bool, layout: Layout, size: tuple[float, float], tip: str = "") -> bool:
    """Build a button that is lit while it is chosen; return whether it was pressed."""
    if is_chosen:
        for color in (imgui.Col_.button, imgui.Col_.button_hovered):
            imgui.push_style_color(color, imgui.get_style().color_(imgui.Col_.button_active))
    pressed = imgui.button(text, imgui.ImVec2(*size))
    if is_chosen:
        imgui.pop_style_color(2)
    tooltip(tip, layout)
    return bool(pressed)


def combo(name: str, shown: str, entries: Sequence[tuple[str, str]], layout: Layout, tip: str = "") -> int | None:
    """Build a list that opens; return the index of a picked entry. entries: words and tooltip of each. shown: words of
    the chosen entry.
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
    """Build a section's heading over the whole width; return whether it was pressed."""
    icon = icons.ICON_FA_CHEVRON_DOWN if is_open else icons.ICON_FA_CHEVRON_RIGHT
    imgui.push_style_var(imgui.StyleVar_.button_text_align, imgui.ImVec2(0, 0.5))
    imgui.push_style_color(imgui.Col_.button, imgui.ImVec4(0, 0, 0, 0))
    is_pressed = imgui.button(f"{icon}  {text}###section {text}", imgui.ImVec2(-1, 0))
    imgui.pop_style_color()
    imgui.pop_style_var()
    return bool(is_pressed)


def in_row(items: Sequence[Item], layout: Layout, a_row: int = 0) -> Iterator[tuple[Item, float]]:
    """Yield each item with its width, side by side over the whole width. a_row: number of items in a row, 0 for all."""
    count, spacing = a_row or len(items), 4 * layout.ui_scale
    width = (imgui.get_content_region_avail().x - spacing * (count - 1)) / count
    for i, item in enumerate(items):
        if i % count:
            imgui.same_line(0, spacing)
        yield item, width


def quiet(text: str) -> None:
    """Build words that do not ask for attention."""
    colored(text, imgui.get_style().color_(imgui.Col_.text_disabled))


def colored(text: str, color: imgui.ImVec4) -> None:
    """Build words in a colour, on as many lines as they need."""
    imgui.push_style_color(imgui.Col_.text, color)
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def gap(layout: Layout, units: float = 4.0) -> None:
    """Leave some room."""
    imgui.dummy(imgui.ImVec2(0, units * layout.ui_scale))


def tooltip(text: str, layout: Layout) -> None:
    """Show words while the pointer rests on the last item: left of the panel, or below or above the item's window, so
    that no widget is hidden.
    """
    if not text or not imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled):
        return
    corner, pivot = _place_beside_panel(layout) if _is_in_panel(layout) else _place_at_window(layout)
    imgui.set_next_window_pos(corner, 0, pivot)
    imgui.begin_tooltip()
    imgui.push_text_wrap_pos(TOOLTIP_WIDTH * layout.ui_scale)
    imgui.text(text)
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()


def _is_in_panel(layout: Layout) -> bool:
    return bool(imgui.get_window_pos().x >= layout.panel.x)


def _place_beside_panel(layout: Layout) -> tuple[imgui.ImVec2, imgui.ImVec2]:
    """Return a place level with the last item, and which corner of the tooltip lies there, as shares of its size."""
    is_low = imgui.get_item_rect_max().y > 0.75 * layout.window.height
    y = imgui.get_item_rect_max().y if is_low else imgui.get_item_rect_min().y
    corner = imgui.ImVec2(layout.panel.x - 4 * layout.ui_scale, min(y, layout.window.height))
    return corner, imgui.ImVec2(1, 1 if is_low else 0)


def _place_at_window(layout: Layout) -> tuple[imgui.ImVec2, imgui.ImVec2]:
    """Return a place below the item's window, or above it where there is more room, left of the panel."""
    width = TOOLTIP_WIDTH * layout.ui_scale + 2 * imgui.get_style().window_padding.x
    position, x = imgui.get_window_pos(), max(min(imgui.get_item_rect_min().x, layout.panel.x - width), 0.0)
    bottom, space = position.y + imgui.get_window_height(), 4 * layout.ui_scale
    if layout.window.height - bottom < position.y:
        return imgui.ImVec2(x, position.y - space), imgui.ImVec2(0, 1)
    return imgui.ImVec2(x, bottom + space), imgui.ImVec2(0, 0)


def last_part(path: str) -> str:
    """Return the last part of a path of any system."""
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2] or path
