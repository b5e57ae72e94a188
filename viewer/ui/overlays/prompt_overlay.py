"""Small windows in the middle: where to save, which file to open, the commands by name, the map of mouse and keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath
from typing import TypeVar

from imgui_bundle import imgui

from iibr_core.formats.images.picture_kinds import BEST_QUALITY, KINDS, PROFILES
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB
from viewer.model import messages, saving
from viewer.model.action import Action, ask, do
from viewer.model.commands import COMMANDS, Command, commands_matching, recent_commands
from viewer.model.layout import PANEL_WIDTH, Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import ModelsPrompt
from viewer.model.state.exporting import ExportPrompt
from viewer.model.state.jobs import JobProgress
from viewer.model.state.prompts import PalettePrompt, PathPrompt, Prompt, SavePrompt
from viewer.model.state.tasks import ChoosePlaceTask, SaveTask
from viewer.ui.overlays.export_prompt import ALREADY_THERE, export_prompt
from viewer.ui.overlays.file_browser import file_browser
from viewer.ui.overlays.models_prompt import models_prompt
from viewer.ui.overlays.prompt_rows import (
    PROMPT_FLAGS,
    button_rows,
    focus_on_appearing,
    path_row,
    prompt_actions,
    prompt_buttons,
    say_problem,
    search_field,
    size_rows,
)
from viewer.ui.widgets import button, gap, label, quiet

Option = TypeVar("Option")
PROMPT_WIDTH = 460.0
KEYS_WIDTH = 112.0
ROWS_SHOWN = 12
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
PICTURE_ENDINGS = "The name's ending decides the kind: .png, .jpg, .tif, .webp, .avif, or .exr (HDR)."
MAP_ENDINGS = "The name's ending decides the kind: .pfm, .exr, .npy, .tif, or .png (16 bits, scaled)."


def prompts(state: AppState, layout: Layout) -> list[Action]:
    """Build the prompt that is asked for, if any."""
    prompt = state.prompt
    if prompt is None:
        return []
    _place(prompt, layout)
    imgui.begin(f"prompt {type(prompt).__name__}", None, PROMPT_FLAGS)
    # A field that is typed in takes Esc for itself; one Esc is to close all of it.
    is_left = imgui.get_io().want_text_input and imgui.is_key_pressed(imgui.Key.escape, False)
    actions = _contents(prompt, state, layout)
    imgui.end()
    if is_left:
        return [do(messages.show_prompt, None)]
    return actions


def _place(prompt: Prompt, layout: Layout) -> None:
    """In the middle of the picture; the help in the panel's place: it is read while the hand tries it."""
    scale, window = layout.ui_scale, layout.window
    if prompt == "help":
        imgui.set_next_window_pos(imgui.ImVec2(window.width, 0), 0, imgui.ImVec2(1, 0))
        width = min(PANEL_WIDTH * scale, window.width)
        imgui.set_next_window_size_constraints(imgui.ImVec2(width, window.height), imgui.ImVec2(width, window.height))
        return
    width = min(PROMPT_WIDTH * scale, window.width)
    middle = imgui.ImVec2(max(layout.panel.x, width) / 2, window.height / 2)
    imgui.set_next_window_pos(middle, 0, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size(imgui.ImVec2(width, 0))


def _contents(prompt: Prompt, state: AppState, layout: Layout) -> list[Action]:
    match prompt:
        case SavePrompt():
            return _save(prompt, state, layout)
        case ExportPrompt():
            return export_prompt(prompt, state, layout)
        case PathPrompt():
            return file_browser(prompt, state, layout)
        case ModelsPrompt():
            return models_prompt(prompt, state, layout)
        case PalettePrompt():
            return _palette(prompt, state, layout)
        case "quit":
            return _quit(state, layout)
        case "help":
            keys = ((", ".join(chord.words for chord in c.chords), c.name) for c in COMMANDS if c.chords)
            return _help(layout, [*MOUSE, *keys])


def _save(prompt: SavePrompt, state: AppState, layout: Layout) -> list[Action]:
    """File and size; the picture's shape is kept."""
    is_map = prompt.what == "map"
    imgui.text("Save the depth map" if is_map else "Save the picture")
    gap(layout, 2)
    path, entered, browses = path_row("File", prompt.path, layout)
    edited = prompt if path == prompt.path else replace(prompt, path=path, already_there=False, problem="")
    edited = edited if is_map else _form_rows(_sized(edited, state, layout), state, layout)
    gap(layout, 2)
    quiet(MAP_ENDINGS if is_map else PICTURE_ENDINGS)
    say_problem(prompt.problem or (ALREADY_THERE if prompt.already_there else ""), state)
    pressed, closed = prompt_buttons("Replace" if prompt.already_there else "Save", layout)
    if browses:
        return [do(messages.show_prompt, edited), do(ask, ChoosePlaceTask(edited))]
    if pressed or entered:
        return [do(ask, SaveTask(edited.path, edited.size_px, prompt.already_there, prompt.what, edited.form))]
    return prompt_actions(closed, edited, prompt)


def _sized(prompt: SavePrompt, state: AppState, layout: Layout) -> SavePrompt:
    """With the size that its rows say."""
    width = size_rows(prompt.size_px, layout)
    if width is None or state.scene is None:
        return prompt
    height = max(round(width * state.scene.height / state.scene.width), 1)
    return replace(prompt, size_px=ScreenSize(width, height))


def _form_rows(prompt: SavePrompt, state: AppState, layout: Layout) -> SavePrompt:
    """Rows for what the kind of file that was typed can be told."""
    kind, form, scene = KINDS.get(PurePath(prompt.path).suffix.lower()), prompt.form, state.scene
    if kind is None or scene is None:
        return prompt
    if form.bits not in kind.bits:
        form = replace(form, bits=None)  # of another kind, typed before
    if kind.has_quality:
        label("Quality", layout, "Less makes a smaller file, with coarser detail.")
        form = replace(form, quality=imgui.slider_int("##quality", form.quality, 1, BEST_QUALITY)[1])
    if len(kind.bits) > 1:
        label("Bits", layout, "Of each colour: 16 keep smooth skies smooth when the picture is edited later.")
        usual = form.bits or kind.bits[0]
        chosen = _radio({str(bits): bits for bits in sorted(kind.bits)}, usual)
        form = form if chosen == usual else replace(form, bits=chosen)
    if scene.color_space != SRGB or form.color_space is not None:
        label("Colours", layout, "Display P3 holds more of the photo's than sRGB, which every program shows.")
        space = form.space_for(scene.color_space)
        chosen_space = _radio({profile.name: profile for profile in PROFILES.values()}, space)
        form = form if chosen_space == space else replace(form, color_space=chosen_space)
    label("Place", layout, "Where the photo was taken, if its file says so.")
    form = replace(form, keeps_position=imgui.checkbox("Keep it in the picture", form.keeps_position)[1])
    return prompt if form == prompt.form else replace(prompt, form=form)


def _radio(choices: Mapping[str, Option], chosen: Option) -> Option:
    """One of some, side by side."""
    for i, (words, choice) in enumerate(choices.items()):
        if i:
            imgui.same_line()
        if imgui.radio_button(words, choice == chosen):
            chosen = choice
    return chosen


def _palette(prompt: PalettePrompt, state: AppState, layout: Layout) -> list[Action]:
    """Commands that match what was typed; the arrow keys select one of them, Enter runs it."""
    focus_on_appearing()
    imgui.set_next_item_width(-1)
    text, entered = search_field("command", prompt.text, "Type a command")
    matching = commands_matching(text, recent_commands(state))
    steps = imgui.is_key_pressed(imgui.Key.down_arrow) - imgui.is_key_pressed(imgui.Key.up_arrow)
    selected = min(max((prompt.selected if text == prompt.text else 0) + steps, 0), max(len(matching) - 1, 0))
    chosen = matching[selected] if entered and matching else None
    pressed = _command_rows(matching, selected, has_moved=bool(steps))
    if not matching:
        quiet("No command has these words: try fewer.")
    chosen = pressed or chosen
    if chosen is not None:
        return [do(messages.show_prompt, None), chosen.action(replace(state, prompt=None))]
    return prompt_actions(False, PalettePrompt(text, selected), prompt)


def _command_rows(commands: Sequence[Command], selected: int, has_moved: bool) -> Command | None:
    """Rows that scroll where there are many; has_moved: bring the selected one into sight. What was pressed."""
    pressed = None
    height = min(len(commands), ROWS_SHOWN) * imgui.get_text_line_height_with_spacing()
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


def _help(layout: Layout, rows: list[tuple[str, str]]) -> list[Action]:
    """What the mouse and the keys do; the button stays in sight where the rows scroll."""
    style = imgui.get_style()
    button_width = imgui.calc_text_size("Close").x + 2 * style.frame_padding.x
    imgui.align_text_to_frame_padding()
    imgui.text("Mouse and keys")
    imgui.same_line(imgui.get_window_width() - style.window_padding.x - button_width)
    is_closed = button("Close", layout)
    gap(layout, 2)
    if imgui.begin_table("keys", 2, imgui.TableFlags_.scroll_y):
        imgui.table_setup_column("what", imgui.TableColumnFlags_.width_fixed, KEYS_WIDTH * layout.ui_scale)
        imgui.table_setup_column("meaning", imgui.TableColumnFlags_.width_stretch)
        for what, meaning in rows:
            imgui.table_next_column()
            quiet(what)
            imgui.table_next_column()
            imgui.text_wrapped(meaning.rstrip("…"))
        imgui.end_table()
    return [do(messages.show_prompt, None)] if is_closed else []


def _quit(state: AppState, layout: Layout) -> list[Action]:
    """What would be lost, and what can be done about it. Jobs that end while it is asked need no answer."""
    offers: list[tuple[str, Action]] = []
    if state.jobs:
        imgui.text(f"{jobs_text(state.jobs)} under way.")
        offers.append(("Wait, then quit", do(saving.quit_when_done)))
    gap(layout, 2)
    sure = do(saving.quit_window, is_sure=True)
    words = "Cancel them and quit" if state.jobs else "Quit"
    return button_rows([*offers, (words, sure), ("Cancel", do(messages.show_prompt, None))])


def jobs_text(jobs: Sequence[JobProgress]) -> str:
    """What is under way, in words: "2 exports are", "1 picture and 1 export are"."""
    exports = sum(job.kind == "export" for job in jobs)
    counts = (("picture", len(jobs) - exports), ("export", exports))
    words = " and ".join(f"{count} {noun}{'s' if count > 1 else ''}" for noun, count in counts if count)
    return f"{words} {'is' if len(jobs) == 1 else 'are'}"
