"""The prompt for a path where the system has no file dialog: a field, and small pictures of what its folder holds."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from viewer.model import browsing
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.browsing import PathPrompt
from viewer.model.folder import Thumbnail
from viewer.model.tasks import ChoiceOf, TakePathTask, ask
from viewer.ui.overlays import prompt_rows as rows
from viewer.ui.overlays.filmstrip import CELL_ASPECT, GAP, photo_cell
from viewer.ui.style import palette_of
from viewer.ui.widgets import gap, quiet, scale

WIDTH = 640.0
IN_ROW = 4
SHOWN_ROWS = 3
PATH_WORDS: dict[ChoiceOf, str] = {
    "photo": "Open a photo",
    "folder": "Open a folder of photos or views",
    "mask": "Open a picture as the shape of the aperture; white lets light through",
    "map": "Open a depth map for this photo",
    "model": "Open a depth model: an ONNX file, or a folder",
    "model folder": "Open the folder of a depth model",
}
NOTHING, NO_SUCH_NAME = "Nothing here can be opened.", "No name here begins like that."


def browsed_paths(state: AppState) -> tuple[str, ...]:
    """Return the paths whose small pictures the prompt shows."""
    prompt = state.prompt
    if not isinstance(prompt, PathPrompt):
        return ()
    names = browsing.shown_names(prompt)[prompt.top * IN_ROW : (prompt.top + SHOWN_ROWS + 1) * IN_ROW]
    return tuple(browsing.path_of(prompt, name) for name in names if name != browsing.UP)


def path_prompt(prompt: PathPrompt, state: AppState, thumbnails: Mapping[str, Thumbnail | None]) -> list[Action]:
    """Draw the prompt; return its actions. Tab completes a name, a click goes to a folder or opens a file."""
    imgui.text(PATH_WORDS[prompt.what])
    gap()

    def complete(text: str) -> str:
        return browsing.completed(replace(prompt, path=text))

    row = rows.place_row("Path", prompt.path, replace(state, has_dialogs=False), prompt.problem, complete)
    edited = prompt if row.path == prompt.path else replace(prompt, path=row.path, problem="")
    chosen = None
    if prompt.listing is not None:
        chosen, top = _cells(prompt, state, thumbnails)
        edited = replace(edited, top=top)
    rows.say_problem(edited.problem, state)
    pressed, closed = rows.prompt_buttons("Open")
    if chosen is not None:
        edited = replace(prompt, path=browsing.path_of(prompt, chosen), problem="")
    is_file = chosen is not None and not edited.path.endswith(os.sep)
    if pressed or row.entered or is_file:
        return [do(browsing.edit_path, edited), do(ask, TakePathTask(edited))]
    if closed:
        return rows.prompt_actions(closed, edited, prompt)
    return [do(browsing.edit_path, edited)] if edited != prompt else []


def _cells(prompt: PathPrompt, state: AppState, thumbnails: Mapping[str, Thumbnail | None]) -> tuple[str | None, int]:
    """Draw what the folder holds, in rows that scroll; return the name that was clicked, and the first row seen."""
    names, palette, chosen = browsing.shown_names(prompt), palette_of(state.preferences.theme), None
    space, room = GAP * scale(), imgui.get_content_region_avail().x - imgui.get_style().scrollbar_size
    width = (room - (IN_ROW - 1) * space) / IN_ROW
    height, line = width / CELL_ASPECT, imgui.get_text_line_height()
    pitch = height + line + 2 * space
    imgui.begin_child("entries", imgui.ImVec2(0, SHOWN_ROWS * pitch), 0, imgui.WindowFlags_.no_nav)
    start, top = imgui.get_cursor_screen_pos(), int(imgui.get_scroll_y() / pitch)
    for i, name in enumerate(names):
        row, column = divmod(i, IN_ROW)
        if not top <= row <= top + SHOWN_ROWS:
            continue
        cell = Rect(start.x + column * (width + space), start.y + row * pitch, width, height)
        if photo_cell(cell, name, thumbnails.get(browsing.path_of(prompt, name)), palette):
            chosen = name
        imgui.set_cursor_screen_pos(imgui.ImVec2(cell.x, cell.y + height))
        imgui.push_clip_rect(imgui.ImVec2(cell.x, cell.y), imgui.ImVec2(cell.x + width, cell.y + pitch), True)
        is_folder = name.endswith((os.sep, browsing.UP))
        imgui.text(f"{icons.ICON_FA_FOLDER}  {name}" if is_folder else name)
        imgui.pop_clip_rect()
    imgui.set_cursor_screen_pos(imgui.ImVec2(start.x, start.y + -(-len(names) // IN_ROW) * pitch))
    imgui.dummy(imgui.ImVec2(0, 0))
    if not set(names) - {browsing.UP}:
        quiet(NOTHING if prompt.path == prompt.folder else NO_SUCH_NAME)
    imgui.end_child()
    return chosen, top
