"""The window that asks for a file, a folder or a place, where the system has no dialog: a path to type, and what lies
there to click.
"""

from __future__ import annotations

import os
from dataclasses import replace

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from viewer.model import messages
from viewer.model.action import Action, ask, do
from viewer.model.commands import action_for_path
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.prompts import FOLDER_CHOICES, ChoiceOf, FolderContents, ListContentsTask, PathPrompt
from viewer.ui.overlays.prompt_rows import focus_on_appearing, path_field, prompt_actions, prompt_buttons, say_problem
from viewer.ui.widgets import button, gap, label, quiet

ROWS_SHOWN = 12
PATH_WORDS: dict[ChoiceOf, str] = {
    "photo": "Open a photo",
    "folder": "Open a folder of photos or views",
    "mask": "A picture as the shape of the aperture; white lets light through",
    "map": "A depth map for this photo",
    "model": "A depth model: an ONNX file, or a folder",
    "model folder": "The folder of a depth model",
    "place": "Where to put it",
}


def file_browser(prompt: PathPrompt, state: AppState, layout: Layout) -> list[Action]:
    """Build it. A click on a folder goes into it, one on a file takes its name, a double click opens it."""
    imgui.text(PATH_WORDS[prompt.what])
    gap(layout, 2)
    before, key = imgui.get_state_storage(), imgui.get_id("has stepped by Enter")
    focus_on_appearing()
    if before.get_bool(key):
        imgui.set_keyboard_focus_here(0)
    before.set_bool(key, False)
    label("Path", layout)
    path, entered = path_field(prompt.path, layout)
    contents, stepped = prompt.contents, _steps(path, layout)
    is_opened = False
    if contents is not None:
        gap(layout, 2)
        clicked, is_opened = _rows(contents, path, prompt.what, layout)
        stepped = stepped or clicked
        say_problem(contents.problem, state)
    pressed, closed = prompt_buttons("Choose" if prompt.returns_to else "Open", layout)
    path = stepped or path
    is_done = is_opened or ((pressed or entered) and bool(path.strip()))
    if is_done and _leads_on(path, prompt):
        path, is_done = os.path.join(path, ""), False
        before.set_bool(key, True)
    if is_done:
        return _take(prompt, path.strip(), state)
    edited = replace(prompt, path=path)
    folder = folder_of(path)
    if contents is None or contents.folder != folder:
        return [
            do(messages.show_prompt, replace(edited, contents=FolderContents(folder))),
            do(ask, ListContentsTask(folder, prompt.what)),
        ]
    return [do(messages.show_prompt, prompt.returns_to)] if closed else prompt_actions(False, edited, prompt)


def folder_of(path: str) -> str:
    """The folder that a path names with a separator at its end, or that holds what it names."""
    return os.path.join(os.path.dirname(path.strip()), "")


def _leads_on(path: str, prompt: PathPrompt) -> bool:
    """Whether it names a folder to look into, where that is not what is asked for."""
    name, contents = os.path.basename(path.strip()), prompt.contents
    if not name:
        return prompt.what not in FOLDER_CHOICES
    is_folder = contents is not None and contents.folder == folder_of(path) and name in contents.folders
    return is_folder and prompt.what not in (*FOLDER_CHOICES, "place")


def _take(prompt: PathPrompt, path: str, state: AppState) -> list[Action]:
    if prompt.returns_to is not None:
        return [do(messages.show_prompt, replace(prompt.returns_to, path=path, already_there=False, problem=""))]
    return [do(messages.show_prompt, None), action_for_path(prompt.what, path, state)]


def _steps(path: str, layout: Layout) -> str:
    """The path after a step up or home, "" without one; a name that was typed stays."""
    folder, name = os.path.split(path.strip())
    if button(f"{icons.ICON_FA_ARROW_UP}  Up", layout, "The folder that holds this one."):
        return os.path.join(os.path.dirname(folder) or os.pardir, name)
    imgui.same_line()
    if button(f"{icons.ICON_FA_HOUSE}  Home", layout, "Your own folder."):
        return os.path.join("~", name)
    return ""


def _rows(contents: FolderContents, path: str, what: ChoiceOf, layout: Layout) -> tuple[str, bool]:
    """Folders, then files, in a list that scrolls: the path that was clicked, "" without, and whether to open it."""
    clicked, is_opened = "", False
    imgui.begin_child("contents", imgui.ImVec2(0, ROWS_SHOWN * imgui.get_text_line_height_with_spacing()))
    name = os.path.basename(path.strip())
    if contents.is_read and not (contents.folders or contents.files or contents.problem):
        quiet("There is nothing here to choose.")
    for folder in contents.folders:
        if imgui.selectable(f"{icons.ICON_FA_FOLDER}  {folder}##folder {folder}", folder == name)[0]:
            clicked = os.path.join(contents.folder, folder, name if what == "place" else "")
    for file in contents.files:
        flags = imgui.SelectableFlags_.allow_double_click
        if imgui.selectable(f"{icons.ICON_FA_IMAGE}  {file}##file {file}", file == name, flags)[0]:
            clicked, is_opened = os.path.join(contents.folder, file), imgui.is_mouse_double_clicked(0)
    imgui.end_child()
    return clicked, is_opened
