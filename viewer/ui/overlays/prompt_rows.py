"""Rows and buttons that prompts and cards share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePath
from typing import NamedTuple, TypeVar

from imgui_bundle import imgui

from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.app_state import AppState, Prompt
from viewer.model.saving import ExportPrompt, SavePrompt
from viewer.model.tasks import ChoosePlaceTask, SaveTask, ShowFileTask, ask
from viewer.ui.style import palette_of
from viewer.ui.widgets import button, colored, combo, gap, label, scale

Choice = TypeVar("Choice", bound=str)
PlacePrompt = TypeVar("PlacePrompt", SavePrompt, ExportPrompt)
PROMPT_FLAGS = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.always_auto_resize
)
CARD_FLAGS = PROMPT_FLAGS | imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_focus_on_appearing
"""Flags of a card that stands by itself over the picture."""
BROWSE = "Browse…"
LARGEST_SIDE_PX = 65536
"""Largest side of a picture that is asked for in the window, in pixels."""
WIDTH_FIELD = 80.0
"""Width of the field for the width of a picture."""
FILE_EXISTS = "A file with this name exists. Replace it?"
PROBLEM_LINES = 2
"""Lines kept free for a problem, so that no button moves when one appears."""


def prompt_actions(closed: bool, edited: Prompt, prompt: Prompt) -> list[Action]:
    """Return the action that closes a prompt, or keeps what was edited in it."""
    if closed:
        return [do(messages.show_prompt, None)]
    return [do(messages.show_prompt, edited)] if edited != prompt else []


class PlaceRow(NamedTuple):
    """Answer of the row of a path. entered: whether Enter was pressed in it. browses: whether Browse was pressed."""

    path: str
    entered: bool
    browses: bool


def place_row(
    text: str, path: str, state: AppState, problem: str = "", complete: Callable[[str], str] | None = None
) -> PlaceRow:
    """Draw a row for a path, which shows its end if it is long; with a button where the system has dialogs. The field
    has the keys when the prompt or a problem appears. complete: what Tab makes of the path.
    """
    style = imgui.get_style()
    width = imgui.calc_text_size(BROWSE).x + 2 * style.frame_padding.x + style.item_spacing.x
    before, key = imgui.get_state_storage(), imgui.get_id("problem")
    if problem and not before.get_bool(key):
        imgui.set_keyboard_focus_here(0)
    before.set_bool(key, bool(problem))
    focus_on_appearing()
    label(text)
    imgui.set_next_item_width(-width if state.has_dialogs else -1)
    new, is_entered = text_field("path", path, flags=imgui.InputTextFlags_.elide_left, complete=complete)
    if not state.has_dialogs:
        return PlaceRow(new, is_entered, False)
    imgui.same_line()
    return PlaceRow(new, is_entered, button(BROWSE))


def place_actions(
    prompt: PlacePrompt,
    edited: PlacePrompt,
    row: PlaceRow,
    word: str,
    state: AppState,
    written: str = "",
) -> list[Action]:
    """Draw the problem and the buttons of a prompt to save or export; return its actions.

    word: on the button that begins it. written: name of the file, if it differs from the typed one.
    """
    edited = replace(edited, path=row.path)
    if edited != prompt:
        edited = replace(edited, already_there=False, problem="")
    if edited.already_there:
        return _ask_to_replace(edited, row, written or PurePath(edited.path.strip()).name, state)
    say_problem(edited.problem, state)
    pressed, closed = prompt_buttons(word)
    if row.browses:
        return [do(messages.show_prompt, edited), do(ask, ChoosePlaceTask(edited))]
    if pressed or row.entered:
        return [do(messages.show_prompt, edited), do(ask, SaveTask(edited))]
    return prompt_actions(closed, edited, prompt)


def _ask_to_replace(
    prompt: PlacePrompt,
    row: PlaceRow,
    name: str,
    state: AppState,
) -> list[Action]:
    """Ask whether to replace a file that exists. Enter cancels, and goes back to the prompt."""
    place, folder = Path(prompt.path.strip()).expanduser().parent, state.folder
    is_photo = folder is not None and place == Path(folder.path) and name in [photo.name for photo in folder.photos]
    say_problem(f"{name} is a photo of the open folder. Replace it?" if is_photo else FILE_EXISTS, state)
    gap()
    cancelled = button("Cancel") or is_enter_free() or row.entered
    imgui.same_line()
    if button(f"Replace {name}"):
        return [do(ask, SaveTask(prompt, True))]
    return [do(messages.show_prompt, replace(prompt, already_there=False))] if cancelled else []


def prompt_buttons(word: str) -> tuple[bool, bool]:
    """Draw the buttons of a prompt; return (whether it was confirmed, by Enter too, whether it was cancelled)."""
    gap()
    pressed = button(word)
    imgui.same_line()
    return pressed or is_enter_free(), button("Cancel")


def is_enter_free() -> bool:
    """Return whether Enter went down, neither in a text field nor in a list."""
    is_taken = imgui.get_io().want_text_input or imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
    return is_enter() and not is_taken and not imgui.is_window_appearing()


def is_enter() -> bool:
    """Return whether an Enter key went down in this frame."""
    return bool(imgui.is_key_pressed(imgui.Key.enter, False) or imgui.is_key_pressed(imgui.Key.keypad_enter, False))


def text_field(
    name: str, text: str, hint: str = "", flags: int = 0, complete: Callable[[str], str] | None = None
) -> tuple[str, bool]:
    """Draw a text field; return the text, and whether Enter was pressed in it. complete: what Tab makes of the text."""
    replace_text = None
    if complete is not None:
        flags |= imgui.InputTextFlags_.callback_completion
        replace_text = partial(_replace_text, complete)
    _, new = imgui.input_text_with_hint(f"##{name}", hint, text, flags, replace_text)
    return new, bool(imgui.is_item_deactivated() and is_enter())


def _replace_text(complete: Callable[[str], str], data: imgui.InputTextCallbackData) -> int:
    """Put the completed text in the place of that in a field."""
    new = complete(str(data.buf))
    data.delete_chars(0, data.buf_text_len)
    data.insert_chars(0, new)
    return 0


def search_field(name: str, text: str, hint: str) -> tuple[str, bool]:
    """Draw a text field that also takes what was typed in the frame before it got the keys."""
    typed = "".join(map(chr, imgui.get_io().input_queue_characters))
    new, is_entered = text_field(name, text, hint)
    if imgui.is_window_appearing():
        return text + typed, False
    if text and imgui.is_item_activated():  # ImGui selects all of it, so that what is typed would take its place
        imgui.internal.get_input_text_state(imgui.get_item_id()).reload_user_buf_and_move_to_end()
        return text + typed, False
    return new, is_entered


def focus_on_appearing() -> None:
    """Give the keys to the next item when its prompt appears."""
    if imgui.is_window_appearing():
        imgui.set_keyboard_focus_here(0)


def choice_row(name: str, chosen: Choice, entries: Mapping[Choice, tuple[str, str]]) -> Choice:
    """Draw a list of (words, meaning); return the chosen entry."""
    picked = combo(name, entries[chosen][0], tuple(entries.values()))
    return chosen if picked is None else tuple(entries)[picked]


def size_row(size_px: tuple[int, int]) -> int | None:
    """Draw width and height; return the new width if the user changed it."""
    label("Size", "Width and height in pixels; the height follows the width.")
    imgui.set_next_item_width(WIDTH_FIELD * scale())
    changed, width = imgui.input_int("##width", size_px[0], 0, 0)
    imgui.same_line()
    imgui.text(f"x {size_px[1]} pixels")
    return min(max(width, 1), LARGEST_SIDE_PX) if changed else None


def say_problem(problem: str, state: AppState) -> None:
    """Draw a problem, or keep room for it."""
    top = imgui.get_cursor_pos_y()
    colored(problem, imgui.ImVec4(*palette_of(state.preferences.theme).error))
    bottom = top + PROBLEM_LINES * imgui.get_text_line_height_with_spacing()
    imgui.set_cursor_pos_y(max(imgui.get_cursor_pos_y(), bottom))


def button_rows(offers: list[tuple[str, Action]]) -> list[Action]:
    """Draw buttons side by side, on as many lines as they need; return the actions of those that were pressed."""
    actions: list[Action] = []
    style = imgui.get_style()
    right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    for i, (words, action) in enumerate(offers):
        width = imgui.calc_text_size(words.partition("##")[0]).x + 2 * style.frame_padding.x
        if i and imgui.get_item_rect_max().x + style.item_spacing.x + width <= right:
            imgui.same_line()
        if imgui.button(words):
            actions.append(action)
    return actions


def file_offers(path: str, number: int = 0) -> list[tuple[str, Action]]:
    """Return buttons that show a written file. number: index of the file, for names of the buttons."""
    return [
        (f"Show in folder##{number}", do(ask, ShowFileTask(path, in_folder=True))),
        (f"Open##{number}", do(ask, ShowFileTask(path))),
    ]
