"""Prompts in the middle of the window: saves, exports, paths, the commands by name, mouse and keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from imgui_bundle import imgui

from viewer.model import messages, saving
from viewer.model.action import Action, do
from viewer.model.app_state import AppState, Prompt
from viewer.model.browsing import PathPrompt
from viewer.model.commands import COMMANDS, Command, PalettePrompt, commands_matching, recent_commands
from viewer.model.depth_models import ModelsPrompt
from viewer.model.folder import Thumbnail
from viewer.model.layout import PANEL_WIDTH, Layout
from viewer.model.saving import ExportPrompt, FinishedFile, JobProgress, SavePrompt
from viewer.model.tasks import ShowFileTask, ask
from viewer.ui.overlays import prompt_rows as rows
from viewer.ui.overlays.export_prompt import export_prompt
from viewer.ui.overlays.models_prompt import models_prompt
from viewer.ui.overlays.notice_corner import build_rows, job_rows
from viewer.ui.overlays.path_prompt import WIDTH as PATH_WIDTH
from viewer.ui.overlays.path_prompt import path_prompt
from viewer.ui.overlays.save_prompt import save_prompt
from viewer.ui.widgets import button, gap, last_part, quiet, scale
from viewer.version import program_commit, program_licence, program_pages, program_version

PROMPT_WIDTH = 460.0
PROMPT_TOP = 0.05
"""Top of a prompt, as a share of the window's height: it grows downwards, so nothing above moves."""
KEYS_WIDTH = 112.0
MAX_ROWS = 12
"""Number of commands shown without scrolling."""
MOUSE = (
    ("Drag", "Move the viewpoint"),
    ("Click", "Focus there"),
    ("Double click", "Recenter: back to the photo's own viewpoint"),
    ("Wheel", "Focus nearer or farther"),
    ("Ctrl+wheel", "Zoom about the pointer"),
    ("Drag with the middle button", "Move the zoomed picture"),
    ("Arrow keys", "Move the viewpoint"),
    ("Drop", "Open a photo, a folder, a depth map"),
    ("Ctrl+click a slider", "Type a value"),
    ("Drag with the depth brush", "Paint depth; the wheel makes it larger"),
    ("Ctrl+click with the depth brush", "Pick the depth that Level and Bucket give"),
    ("Esc", "Close what is open, put the brush away"),
)


def prompts(state: AppState, layout: Layout, thumbnails: Mapping[str, Thumbnail | None]) -> list[Action]:
    """Draw the prompt, if there is one; return the actions of the user. thumbnails: see `browsed_paths`."""
    prompt = state.prompt
    if prompt is None:
        return []
    _place(prompt, layout)
    imgui.push_style_var(imgui.StyleVar_.window_border_size, scale())  # the panel behind has the same colour
    imgui.begin(f"prompt {type(prompt).__name__}", None, rows.PROMPT_FLAGS)
    # A text field takes Esc for itself; one Esc closes the prompt.
    is_left = imgui.get_io().want_text_input and imgui.is_key_pressed(imgui.Key.escape, False)
    actions = _contents(prompt, state, thumbnails)
    imgui.end()
    imgui.pop_style_var()
    return [do(messages.show_prompt, None)] if is_left else actions


def _place(prompt: Prompt, layout: Layout) -> None:
    """Place a prompt over the picture; the help in the panel's place, so that it can be read while the hand tries."""
    window = layout.window
    if prompt == "help":
        imgui.set_next_window_pos(imgui.ImVec2(window.width, 0), 0, imgui.ImVec2(1, 0))
        width = min(PANEL_WIDTH * scale(), window.width)
        imgui.set_next_window_size_constraints(imgui.ImVec2(width, window.height), imgui.ImVec2(width, window.height))
        return
    width, top = min(PROMPT_WIDTH * scale(), window.width), PROMPT_TOP * window.height
    if isinstance(prompt, PathPrompt):
        width = max(min(PATH_WIDTH * scale(), (layout.panel.x or window.width) - 8 * scale()), width)
    room = min(max(layout.panel.x, width + 8 * scale()), window.width)
    imgui.set_next_window_pos(imgui.ImVec2(room / 2, top), 0, imgui.ImVec2(0.5, 0))
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, window.height - top))


def _contents(prompt: Prompt, state: AppState, thumbnails: Mapping[str, Thumbnail | None]) -> list[Action]:
    match prompt:
        case SavePrompt():
            return save_prompt(prompt, state)
        case ExportPrompt():
            return export_prompt(prompt, state)
        case PathPrompt():
            return path_prompt(prompt, state, thumbnails)
        case ModelsPrompt():
            return models_prompt(prompt, state)
        case PalettePrompt():
            return _palette(prompt, state)
        case "files":
            return _files(state)
        case "quit":
            return _quit(state)
        case "about":
            return _about()
        case "help":
            keys = ((", ".join(chord.words for chord in c.chords), c.name) for c in COMMANDS if c.chords)
            return _help([*MOUSE, *keys])


def _files(state: AppState) -> list[Action]:
    """Draw the saves and exports that run, and the files that are written."""
    imgui.text("Saved files")
    gap()
    running = job_rows([job for job in state.jobs if job.kind != "copy"])
    if not running and not state.files:
        quiet("Nothing was saved or exported since the window opened.")
    actions = build_rows(running)
    for number, finished in enumerate(state.files):
        gap()
        actions += _finished(finished, number)
    gap()
    return [*actions, *rows.button_rows([("Close", do(messages.show_prompt, None))])]


def _finished(finished: FinishedFile, number: int) -> list[Action]:
    imgui.text(last_part(finished.path))
    quiet(finished.problem or finished.path)
    again = do(messages.show_prompt, replace(finished.prompt, already_there=False, problem=""))
    offers: list[tuple[str, Action]] = [] if finished.problem else rows.file_offers(finished.path, number)
    return rows.button_rows([*offers, (f"Again…##{number}", again)])


def _palette(prompt: PalettePrompt, state: AppState) -> list[Action]:
    """Draw the commands that match the typed text; the arrow keys select one, Enter runs it."""
    rows.focus_on_appearing()
    imgui.set_next_item_width(-1)
    text, entered = rows.search_field("command", prompt.text, "Type a command")
    matching = commands_matching(text, recent_commands(state))
    steps = imgui.is_key_pressed(imgui.Key.down_arrow) - imgui.is_key_pressed(imgui.Key.up_arrow)
    selected = min(max((prompt.selected if text == prompt.text else 0) + steps, 0), max(len(matching) - 1, 0))
    pressed = _command_rows(matching, selected, has_moved=bool(steps))
    if not matching:
        quiet("No command contains these words.")
    chosen = pressed or (matching[selected] if entered and matching else None)
    if chosen is not None:
        return [do(messages.show_prompt, None), chosen.action(replace(state, prompt=None))]
    return rows.prompt_actions(False, PalettePrompt(text, selected), prompt)


def _command_rows(commands: Sequence[Command], selected: int, has_moved: bool) -> Command | None:
    """Draw a list of commands; return the one that was pressed. has_moved: whether to scroll to the selected one."""
    pressed = None
    height = min(len(commands), MAX_ROWS) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("commands", imgui.ImVec2(0, max(height, 1)), 0, imgui.WindowFlags_.no_nav)
    room = imgui.get_content_region_avail().x - imgui.get_style().item_inner_spacing.x
    for i, command in enumerate(commands):
        if imgui.selectable(f"{command.name}##{i}", i == selected)[0]:
            pressed = command
        if i == selected and has_moved:
            imgui.set_scroll_here_y()
        if command.chords:
            words = command.chords[0].words
            imgui.same_line(room - imgui.calc_text_size(words).x)
            imgui.text_disabled(words)
    imgui.end_child()
    return pressed


def _help(keys: list[tuple[str, str]]) -> list[Action]:
    """Draw the map of mouse and keys; the buttons stay in sight while the rows scroll."""
    style = imgui.get_style()
    widths = [imgui.calc_text_size(words).x + 2 * style.frame_padding.x for words in ("About", "Close")]
    imgui.align_text_to_frame_padding()
    imgui.text("Mouse and keys")
    imgui.same_line(imgui.get_window_width() - style.window_padding.x - sum(widths) - style.item_spacing.x)
    actions = [do(messages.show_prompt, "about")] if button("About") else []
    imgui.same_line()
    is_closed = button("Close")
    gap()
    if imgui.begin_table("keys", 2, imgui.TableFlags_.scroll_y):
        imgui.table_setup_column("what", imgui.TableColumnFlags_.width_fixed, KEYS_WIDTH * scale())
        imgui.table_setup_column("meaning", imgui.TableColumnFlags_.width_stretch)
        for what, meaning in keys:
            imgui.table_next_column()
            quiet(what)
            imgui.table_next_column()
            imgui.text_wrapped(meaning.rstrip("…"))
        imgui.end_table()
    return [do(messages.show_prompt, None)] if is_closed else actions


def _about() -> list[Action]:
    """Draw what the program is, and a button for each page; return the actions of the pressed ones."""
    imgui.text(f"iibr {program_version()}")
    quiet(f"Commit {program_commit()}, licence {program_licence()}")
    quiet("The program never looks for a newer version by itself.")
    gap()
    pages = program_pages()
    return rows.button_rows(
        [
            ("Look for a newer version", do(ask, ShowFileTask(pages["Releases"]))),
            ("Libraries and licences", do(ask, ShowFileTask(f"{pages['Documentation']}/licences.md"))),
            ("Close", do(messages.show_prompt, None)),
        ]
    )


def _quit(state: AppState) -> list[Action]:
    """Draw the jobs that quitting would cancel, and the choices. Jobs may end while it is asked."""
    offers: list[tuple[str, Action]] = []
    if state.jobs:
        imgui.text(f"{jobs_text(state.jobs)} in progress.")
        offers.append(("Wait, then quit", do(saving.quit_when_done)))
    gap()
    words = "Cancel them and quit" if state.jobs else "Quit"
    sure = do(saving.quit_window, is_sure=True)
    return rows.button_rows([*offers, (words, sure), ("Cancel", do(messages.show_prompt, None))])


def jobs_text(jobs: Sequence[JobProgress]) -> str:
    """Return the number of jobs in words: "2 exports are", "1 picture and 1 export are"."""
    exports = sum(job.kind == "export" for job in jobs)
    counts = (("picture", len(jobs) - exports), ("export", exports))
    words = " and ".join(f"{count} {noun}{'s' if count > 1 else ''}" for noun, count in counts if count)
    return f"{words} {'is' if len(jobs) == 1 else 'are'}"
