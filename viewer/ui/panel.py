"""The panel at the right: tools, the essentials of the open picture, and sections under "More" and "Advanced"."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from iibr_core.runtime.time_left import about_left
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import Progress, Scene, source_beside
from viewer.model import messages, opening, preferences
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME
from viewer.model.layout import Layout
from viewer.model.preferences import PARENT_SECTION, SECTIONS, Section, is_seen_open
from viewer.model.remedies import words_of
from viewer.model.window import DrawReport
from viewer.ui.sections import (
    depth_section,
    essentials,
    gloss_section,
    inspect,
    lens_section,
    stereo_section,
    view_section,
)
from viewer.ui.widgets import FIXED, button, gap, heading, in_row, label, last_part, lines, quiet, scale, tooltip

TOOLS = (
    (f"{icons.ICON_FA_IMAGE}  Open", "Open a photo…"),
    (f"{icons.ICON_FA_FLOPPY_DISK}  Save", "Save the picture…"),
    (f"{icons.ICON_FA_SHARE_NODES}  Share", "Share or export…"),
    (f"{icons.ICON_FA_ROTATE_LEFT}  Undo", "Undo"),
    (f"{icons.ICON_FA_ROTATE_RIGHT}  Redo", "Redo"),
    (f"{icons.ICON_FA_CIRCLE_QUESTION}  Help", "Mouse and keys"),
)
"""Label of each tool, and the name of its command."""
TOOLS_IN_ROW = 3
MORE_TOOLS = (
    (f"{icons.ICON_FA_FOLDER_OPEN}  Folder", "Open a folder…"),
    (f"{icons.ICON_FA_CIRCLE_HALF_STROKE}  Theme", "Light or dark"),
)
START_TOOLS = (MORE_TOOLS[1], TOOLS[5])
READY = "Ready"
STATUS_LINES = 2
"""Height of the words on progress, in lines."""
HINT = "Drag the picture to look around it, click to focus."
FLAT_HINT = "All of it is equally far away, so nothing moves."
CANCEL = "Cancel"
CANCEL_TIP = "Stop here: the picture stays as it is now, and moves less smoothly."


def panel(state: AppState, layout: Layout) -> list[Action]:
    """Build the panel; return what the user changed."""
    rect = layout.panel
    if not rect.width:
        return []
    imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
    imgui.set_next_window_size(imgui.ImVec2(rect.width, rect.height))
    imgui.begin("panel", None, FIXED)
    is_empty = state.scene is None and not progress_text(state.progress)  # the start page has all that can be done
    actions = _tools(START_TOOLS if is_empty else TOOLS, state)
    if state.scene is not None:
        actions += _picture(state, state.scene)
    elif progress_text(state.progress):
        actions += _progress(state)
    imgui.end()
    return actions


def _picture(state: AppState, scene: Scene) -> list[Action]:
    gap()
    imgui.text_wrapped(scene.name)
    depth_section.depth_line(state, scene)
    actions = _progress(state)
    gap()
    actions += essentials.essentials(state, scene)
    gap()
    if state.files:  # who saves knows the hint
        latest = last_part(state.files[0].path)
        if button("Saved files…###files", f"{latest} and others that were saved or exported"):
            actions.append(do(messages.show_prompt, "files"))
    else:
        quiet(HINT if aperture_limit(scene) else FLAT_HINT)
    gap()
    for section in SECTIONS:
        actions += _section(section, state, scene)
    return actions


def progress_text(progress: Progress) -> str:
    """Return the progress in a line: "23 of 81 views, about 3 s left", at the end "81 of 81 views, 5 s"; "" if nothing
    was asked for.
    """
    counted = f"{progress.done} of {view_count_text(progress.total)}" if progress.total else ""
    words = progress.doing or counted
    if progress.is_complete:
        return f"{words}, {time_text(progress.seconds)}"
    return f"{words}, {about_left(progress.left_s)}" if progress.left_s is not None else words


def report_text(report: DrawReport, has_all_views: bool) -> str:
    """Return how long drawing took, and whether the picture is final: "Drawn in 12 ms, refining"."""
    words = f"Drawn in {report.draw_ms:.0f} ms"
    if report.samples < report.samples_converged:
        return f"{words}, refining"
    return f"{words}, final" if has_all_views else words


def is_final(state: AppState) -> bool:
    """Return whether no further view can change the picture."""
    is_shown = state.shown_generation == state.generation and state.free_progress is None
    return is_shown and state.progress.is_complete


def time_text(seconds: float) -> str:
    """Return a duration for people: "0.2 s", "12 s", "3 min"."""
    if seconds >= 100:
        return f"{seconds / 60:.0f} min"
    return f"{seconds:.0f} s" if seconds >= 1 else f"{seconds:.1f} s"


def view_count_text(number: int) -> str:
    """Return a number of views in words: "1 view", "81 views"."""
    return f"{number} view" if number == 1 else f"{number} views"


def size_text(scene: Scene) -> str:
    """Return size and views in words: "600 x 400 px, 9 x 9 views"."""
    return f"{scene.width} x {scene.height} px, {scene.grid.rows} x {scene.grid.columns} views"


def _tools(tools: tuple[tuple[str, str], ...], state: AppState) -> list[Action]:
    """Build rows of buttons for commands; a command that cannot be used now is grey."""
    actions: list[Action] = []
    has_scene = state.scene is not None
    is_possible = {"Undo": bool(state.history.past), "Redo": bool(state.history.future)}
    is_possible |= {"Save the picture…": has_scene, "Share or export…": has_scene}
    for (words, name), width in in_row(tools, min(len(tools), TOOLS_IN_ROW)):
        chords = BY_NAME[name].chords
        tip = name.rstrip("…") + (f" ({chords[0].words})" if chords else "")
        if button(f"{words}##{name}", tip, is_possible.get(name, True), width):
            actions.append(BY_NAME[name].action(state))
    return actions


def _recent(state: AppState) -> list[Action]:
    """List the recent files other than the open one."""
    paths = opening.other_recent(state)
    actions: list[Action] = []
    if paths:
        quiet("Recent")
    for path, name in zip(paths, opening.names_of(paths)):
        if imgui.selectable(f"{name}##{path}", False)[0]:
            actions.append(do(opening.open_source, source_beside(state.source, path)))
        tooltip(path)
    return actions


def _progress(state: AppState) -> list[Action]:
    """Build a bar, words, and a button to stop the work. All keep their height, so that nothing below them jumps."""
    progress = state.progress
    words = READY if progress.is_complete else progress_text(progress)
    imgui.progress_bar(progress.share, imgui.ImVec2(-1, 4 * scale()), "")
    is_pressed = False
    start, padding = imgui.get_cursor_pos_x(), 2 * imgui.get_style().frame_padding.x
    room = imgui.get_content_region_avail().x - imgui.calc_text_size(CANCEL).x - padding
    if state.is_making_views:
        imgui.set_cursor_pos_x(start + room)
        is_pressed = imgui.small_button(CANCEL)
        tooltip(CANCEL_TIP)
        imgui.same_line(start)
    lines(words, STATUS_LINES, room - padding / 2)
    return [do(opening.stop)] if is_pressed else []


def _section(section: Section, state: AppState, scene: Scene) -> list[Action]:
    """Build a section's heading, and its content if it is open. A scene of one view has no lens to set."""
    sections = state.preferences.open_sections
    if section in PARENT_SECTION and not is_seen_open(PARENT_SECTION[section], sections):
        return []
    if section in ("focus", "aperture", "view", "stereo display") and not aperture_limit(scene):
        return []
    is_open = section in sections
    is_toggled = heading(section.capitalize(), is_open)
    toggled: list[Action] = [do(preferences.toggle_section, section)] if is_toggled else []
    top = imgui.get_cursor_pos_y()
    actions = toggled + (BUILDERS[section](state, scene) if is_open else [])
    _show_whole(section, is_open, is_toggled, top)
    return actions


def _show_whole(section: Section, is_open: bool, is_pressed: bool, top: float) -> None:
    """Scroll to a section that was opened by its heading, as far as the heading stays in sight. top: of its content."""
    pressed, key = imgui.get_state_storage(), imgui.get_id(f"open {section}")
    row = imgui.get_frame_height_with_spacing()
    wanted_y = imgui.get_cursor_pos_y() + row - imgui.get_window_height()
    if is_open and pressed.get_bool(key) and wanted_y > imgui.get_scroll_y():
        imgui.set_scroll_y(min(top - row, wanted_y))
    pressed.set_bool(key, is_pressed and not is_open)


def _more(state: AppState, scene: Scene) -> list[Action]:
    """Build what stands before the sections under "More": tools and recent files."""
    return _tools(MORE_TOOLS, state) + _recent(state)


def _scene(state: AppState, scene: Scene) -> list[Action]:
    """Build how the views are made and drawn, facts of the file, the plan with its reasons, and notes."""
    quiet(size_text(scene))
    quiet(progress_text(state.progress) or "No views asked for.")
    quiet("" if state.report is None else report_text(state.report, is_final(state)))
    gap()
    facts = state.facts.facts if state.facts and state.facts.path == scene.source.path else ()
    width, height = scene.own_size or scene.size
    shown = "" if (width, height) == scene.size else f", shown at {scene.width} x {scene.height}"
    size = ("Size", f"{width} x {height}{shown}")
    for what, value in (
        *facts,
        size,
        ("Colours", scene.color_space.name),
        ("Depth", depth_section.depth_source(state, scene)),
    ):
        label(what)
        quiet(value)
    gap()
    for reason in scene.plan.reasons if scene.plan else ("A light field from disk: its views are shown as they are.",):
        quiet(reason)
    for note in scene.notes:
        quiet(words_of(note))
    return []


BUILDERS: dict[Section, Callable[[AppState, Scene], list[Action]]] = {
    "more": _more,
    "view": view_section.view_section,
    "focus": lens_section.focus_section,
    "aperture": lens_section.aperture_section,
    "light": lens_section.light_section,
    "gloss": gloss_section.gloss_section,
    "depth": depth_section.depth_section,
    "stereo display": stereo_section.stereo_section,
    "advanced": lambda state, scene: [],
    "inspect": inspect.inspect_section,
    "scene": _scene,
}
"""Functions that build what each section shows before the sections in it."""
