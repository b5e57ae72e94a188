"""Widgets of the panel: a label at the left, the control beside it, and a tooltip.

Sliders and checkboxes return their value, changed or not. `scale` is the size of text and widgets.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TypeVar

from imgui_bundle import imgui

from viewer.model.action import Action, do
from viewer.model.app_state import AppState

Item = TypeVar("Item")
Value = TypeVar("Value")
LABEL_WIDTH = 104.0
"""Width of a row's label at usual size, in window units."""
SPACING = 4.0
"""Distance of buttons in a row at usual size, in window units."""
TOOLTIP_WIDTH = 260.0
FIXED = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_collapse
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_nav
    | imgui.WindowFlags_.no_bring_to_front_on_focus
)
"""Flags of a window that has its place beside the picture."""
TRACK_HEIGHT = 3.0
"""Height of a slider's track at usual size, in window units."""


def scale() -> float:
    """Return the size of text and widgets, 1 for the usual size."""
    return float(imgui.get_style().font_scale_dpi)


def edit(verb: Callable[[AppState, Value], AppState], value: Value, edited: Value) -> list[Action]:
    """Return the action that sets a value of the model, if a widget changed it."""
    return [do(verb, edited)] if edited != value else []


def label(text: str, tip: str = "") -> None:
    """Build a row's label; the next widget stands beside it."""
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    tooltip(tip)
    imgui.same_line(LABEL_WIDTH * scale() + imgui.get_style().window_padding.x)
    imgui.set_next_item_width(-1)


def slider(
    text: str,
    value: float,
    limits: tuple[float, float],
    form: str,
    tip: str = "",
    is_logarithmic: bool = False,
    is_enabled: bool = True,
    unit: float = 1.0,
    zero: float = 0.0,
) -> float:
    """Build a row with a slider; return its value. form: printf-like. Ctrl+click types a value.

    unit, zero: the slider shows (value - zero) / unit.
    """
    low, high, shown = ((number - zero) / unit for number in (*limits, value))
    imgui.begin_disabled(not is_enabled)
    label(text, tip)
    flags = imgui.SliderFlags_.always_clamp | (imgui.SliderFlags_.logarithmic if is_logarithmic else 0)
    for which in (imgui.Col_.slider_grab, imgui.Col_.slider_grab_active):
        imgui.push_style_color(which, 0)
    is_changed, new = imgui.slider_float(f"##{text}", shown, low, high, form, flags)
    imgui.pop_style_color(2)
    low, high, at = (math.log(max(number, 1e-9)) if is_logarithmic else number for number in (low, high, new))
    _draw_track((at - low) / (high - low) if high > low else 0.0)
    imgui.end_disabled()
    tooltip(tip)
    return float(new) * unit + zero if is_changed else value


def _draw_track(share: float) -> None:
    """Draw how far a slider is along the lower edge of the last item, so that its number stays legible."""
    first, last, room = imgui.get_item_rect_min(), imgui.get_item_rect_max(), TRACK_HEIGHT * scale()
    color = imgui.get_color_u32(imgui.Col_.check_mark)
    x = first.x + min(max(share, 0.0), 1.0) * (last.x - first.x - 2 * room) + 2 * room
    draw, top = imgui.get_window_draw_list(), imgui.ImVec2(first.x, last.y - room)
    draw.add_rect_filled(top, imgui.ImVec2(x, last.y), color, room / 2)
    draw.add_rect_filled(imgui.ImVec2(x - 2 * room, last.y - 2 * room), imgui.ImVec2(x, last.y), color, room / 2)


def percent_slider(
    text: str,
    share: float,
    tip: str,
    is_enabled: bool = True,
    limits: tuple[float, float] = (0.0, 1.0),
    form: str = "%.0f %%",
    is_logarithmic: bool = False,
) -> float:
    """Build a row with a slider for a share, shown in per cent; return the share."""
    return slider(text, share, limits, form, tip, is_logarithmic, is_enabled, unit=0.01)


def depth_slider(text: str, disparity: float, limits: tuple[float, float], form: str, tip: str) -> float:
    """Build a row with a slider from near to far, from 0 to 100; return the disparity. limits: (far, near)."""
    far, near = limits
    words, unit = f"near  ·  {form}  ·  far", (far - near) / 100 or 1.0
    return slider(text, disparity, (near, far), words, tip, unit=unit, zero=near)


def checkbox(text: str, is_on: bool, tip: str = "") -> bool:
    """Build a checkbox; return whether it is on."""
    is_on = imgui.checkbox(text, is_on)[1]
    tooltip(tip)
    return is_on


def button(text: str, tip: str = "", is_enabled: bool = True, width: float = 0.0) -> bool:
    """Build a button; return whether it was pressed."""
    imgui.begin_disabled(not is_enabled)
    is_pressed = imgui.button(text, imgui.ImVec2(width, 0))
    imgui.end_disabled()
    tooltip(tip)
    return bool(is_pressed)


def choice(text: str, is_chosen: bool, size: tuple[float, float], tip: str = "") -> bool:
    """Build a button that is lit while it is chosen; return whether it was pressed."""
    if is_chosen:
        for color in (imgui.Col_.button, imgui.Col_.button_hovered):
            imgui.push_style_color(color, imgui.get_style().color_(imgui.Col_.button_active))
    is_pressed = imgui.button(text, imgui.ImVec2(*size))
    if is_chosen:
        imgui.pop_style_color(2)
    tooltip(tip)
    return bool(is_pressed)


def choices(
    entries: Mapping[Item, tuple[str, str]], lit: Collection[object], a_row: int = 0, greyed: Collection[object] = ()
) -> Item | None:
    """Build buttons with (words, tip) side by side, some of them lit or greyed; return the pressed entry."""
    pressed = None
    for (entry, (words, tip)), width in in_row(tuple(entries.items()), a_row, [words for words, _ in entries.values()]):
        imgui.begin_disabled(entry in greyed)
        if choice(words, entry in lit, (width, 0), tip):
            pressed = entry
        imgui.end_disabled()
    return pressed


def switch(
    verb: Callable[[AppState, Item | None], AppState],
    entries: Mapping[Item, tuple[str, str]],
    chosen: Item | None,
    greyed: Collection[object] = (),
) -> list[Action]:
    """Build buttons as `choices`, one of them lit; return the action that chooses the pressed one, or none if lit."""
    pressed = choices(entries, [chosen], greyed=greyed)
    return [] if pressed is None else [do(verb, None if pressed == chosen else pressed)]


def combo(name: str, shown: str, entries: Sequence[tuple[str, str]], tip: str = "") -> int | None:
    """Build a drop-down list of (words, meaning); return the index of the entry that was picked."""
    picked = None
    if imgui.begin_combo(f"##{name}", shown, imgui.ComboFlags_.height_large):
        for i, (words, meaning) in enumerate(entries):
            if imgui.selectable(words, words == shown)[0]:
                picked = i
            tooltip(meaning)
        imgui.end_combo()
    else:
        tooltip(tip)
    return picked


def heading(text: str, is_open: bool) -> bool:
    """Build a section's heading over the whole width; return whether it was pressed."""
    flags = imgui.TreeNodeFlags_
    imgui.set_next_item_open(is_open)
    flag = flags.no_tree_push_on_open | flags.span_full_width | flags.frame_padding
    return bool(imgui.tree_node_ex(f"{text}###section {text}", flag)) != is_open


def in_row(items: Sequence[Item], a_row: int = 0, words: Sequence[str] = ()) -> Iterator[tuple[Item, float]]:
    """Yield each item with its width, side by side over the whole width.

    a_row: number of items in a row, 0 for all. words: of buttons, which get equal widths only if all words fit.
    """
    count, spacing = a_row or len(items), SPACING * scale()
    room = imgui.get_content_region_avail().x - spacing * (count - 1)
    lengths = [imgui.calc_text_size(text).x for text in words]
    fits = max(lengths, default=0) <= room / count - imgui.get_style().frame_padding.x
    for i, item in enumerate(items):
        if i % count:
            imgui.same_line(0, spacing)
        yield item, room / count if fits else lengths[i] + (room - sum(lengths)) / count


def quiet(text: str) -> None:
    """Build words that do not ask for attention."""
    colored(text, imgui.get_style().color_(imgui.Col_.text_disabled))


def colored(text: str, color: imgui.ImVec4) -> None:
    """Build words in a colour, on as many lines as they need."""
    imgui.push_style_color(imgui.Col_.text, color)
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def lines(text: str, count: int, width: float, tip: str = "") -> None:
    """Build quiet words on exactly that many lines, so that nothing below moves; a tooltip shows what does not fit.

    tip: tooltip after that.
    """
    room, start = count * imgui.get_text_line_height(), imgui.get_cursor_pos_y()
    shown = text
    while shown and imgui.calc_text_size(shown, False, width).y > room:
        shown = f"{shown.rstrip('…')[:-1].rstrip()}…"
    imgui.push_text_wrap_pos(imgui.get_cursor_pos_x() + width)
    imgui.text_colored(imgui.get_style().color_(imgui.Col_.text_disabled), shown)
    imgui.pop_text_wrap_pos()
    tooltip("\n".join(filter(None, (text if shown != text else "", tip))))
    imgui.set_cursor_pos_y(start + room)
    imgui.dummy(imgui.ImVec2(0, 0))


def gap(units: float = 2.0) -> None:
    """Leave some room."""
    imgui.dummy(imgui.ImVec2(0, units * scale()))


def tooltip(text: str) -> None:
    """Show words while the pointer rests on the last item: beside the item's window, so that no widget is hidden. None
    are shown while something is pressed or dragged.
    """
    flags = imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled
    if not text or imgui.is_mouse_down(0) or not imgui.is_item_hovered(flags):
        return
    window, size, item = imgui.get_window_pos(), imgui.get_window_size(), imgui.get_item_rect_min()
    screen, space = imgui.get_io().display_size, SPACING * scale()
    width = TOOLTIP_WIDTH * scale() + 2 * imgui.get_style().window_padding.x + space
    if window.x >= width or size.y >= screen.y:
        place, pivot = imgui.ImVec2(max(window.x - space, width), item.y), imgui.ImVec2(1, item.y / screen.y)
    else:
        is_above = screen.y - window.y - size.y < window.y
        y = window.y - space if is_above else window.y + size.y + space
        place, pivot = imgui.ImVec2(max(min(item.x, screen.x - width), 0), y), imgui.ImVec2(0, float(is_above))
    imgui.set_next_window_pos(place, 0, pivot)
    imgui.begin_tooltip()
    imgui.push_text_wrap_pos(TOOLTIP_WIDTH * scale())
    imgui.text(text)
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()


def last_part(path: str) -> str:
    """Return the last part of a path of any system."""
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2] or path
