"""What small windows over the picture share: a text to type, one of some, what is wrong, the buttons below."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from imgui_bundle import imgui

from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.prompts import Prompt
from viewer.model.window_limits import LARGEST_SIDE_PX
from viewer.ui.style import palette_of
from viewer.ui.widgets import button, colored, combo, gap, label, tooltip

Choice = TypeVar("Choice", bound=str)
PROMPT_FLAGS = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.always_auto_resize
)
BROWSE = "Browse…"
CARD_FLAGS = PROMPT_FLAGS | imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_focus_on_appearing
"""Of a card that stands by itself over the picture."""


def prompt_actions(closed: bool, edited: Prompt, prompt: Prompt) -> list[Action]:
    """What becomes of the prompt: it goes, or what was edited in it is kept."""
    if closed:
        return [do(messages.show_prompt, None)]
    return [do(messages.show_prompt, edited)] if edited != prompt else []


def prompt_buttons(word: str, layout: Layout) -> tuple[bool, bool]:
    """(pressed, cancelled); Enter presses, too, but for one that ends typing into a number, or picks from a list."""
    gap(layout, 2)
    pressed = button(word, layout)
    imgui.same_line()
    return pressed or _is_enter_free(), button("Cancel", layout)


def _is_enter_free() -> bool:
    is_taken = imgui.get_io().want_text_input or imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
    return is_enter() and not is_taken and not imgui.is_window_appearing()


def is_enter() -> bool:
    """Whether Enter went down in this frame, wherever it is on the keyboard."""
    return bool(imgui.is_key_pressed(imgui.Key.enter, False) or imgui.is_key_pressed(imgui.Key.keypad_enter, False))


def text_field(name: str, text: str, hint: str = "") -> tuple[str, bool]:
    """The text, and whether Enter was pressed in it."""
    _, new = imgui.input_text_with_hint(f"##{name}", hint, text)
    return new, bool(imgui.is_item_deactivated() and is_enter())


def path_field(path: str, layout: Layout) -> tuple[str, bool]:
    """A text field for a path; one that is too long for it comes up whole over it."""
    new, is_entered = text_field("path", path)
    is_cut = imgui.calc_text_size(new).x > imgui.get_item_rect_size().x
    tooltip(new if is_cut else "", layout)
    return new, is_entered


def path_row(text: str, path: str, layout: Layout) -> tuple[str, bool, bool]:
    """A row for a path, whether Enter was pressed in it, and whether the user wants to look for one instead."""
    width = imgui.calc_text_size(BROWSE).x + 2 * imgui.get_style().frame_padding.x
    focus_on_appearing()
    label(text, layout)
    imgui.set_next_item_width(imgui.get_content_region_avail().x - width - imgui.get_style().item_spacing.x)
    new, is_entered = path_field(path, layout)
    imgui.same_line()
    return new, is_entered, button(BROWSE, layout, "Look for the folder, and choose a name there.")


def search_field(name: str, text: str, hint: str) -> tuple[str, bool]:
    """The same; it also takes what was typed in the frame before it got the keys, with which it begins."""
    typed = "".join(map(chr, imgui.get_io().input_queue_characters))
    new, is_entered = text_field(name, text, hint)
    if imgui.is_window_appearing():
        return text + typed, False
    if text and imgui.is_item_activated():  # ImGui selects all of it, so that what is typed would take its place
        imgui.internal.get_input_text_state(imgui.get_item_id()).reload_user_buf_and_move_to_end()
        return text + typed, False
    return new, is_entered


def focus_on_appearing() -> None:
    """What comes next has the keys once the prompt is there."""
    if imgui.is_window_appearing():
        imgui.set_keyboard_focus_here(0)


def choice_row(name: str, chosen: Choice, entries: Mapping[Choice, tuple[str, str]], layout: Layout) -> Choice:
    """One of these: words, and what they mean."""
    picked = combo(name, entries[chosen][0], tuple(entries.values()), layout)
    return chosen if picked is None else tuple(entries)[picked]


def size_rows(size_px: tuple[int, int], layout: Layout) -> int | None:
    """Width and height; the new width where the user changed it: the height is to follow."""
    label("Width", layout, "Pixels; the height follows.")
    changed, width = imgui.input_int("##width", size_px[0], 0, 0)
    label("Height", layout)
    imgui.align_text_to_frame_padding()
    imgui.text(str(size_px[1]))
    return min(max(width, 1), LARGEST_SIDE_PX) if changed else None


def say_problem(problem: str, state: AppState) -> None:
    """Why it cannot be so, if there is a reason."""
    if problem:
        colored(problem, imgui.ImVec4(*palette_of(state.preferences.theme).error))


def button_rows(offers: list[tuple[str, Action]]) -> list[Action]:
    """Buttons side by side, on as many lines as they need; what was pressed comes back."""
    actions: list[Action] = []
    style = imgui.get_style()
    right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    for i, (words, action) in enumerate(offers):
        width = imgui.calc_text_size(words).x + 2 * style.frame_padding.x
        if i and imgui.get_item_rect_max().x + style.item_spacing.x + width <= right:
            imgui.same_line()
        if imgui.button(words):
            actions.append(action)
    return actions
