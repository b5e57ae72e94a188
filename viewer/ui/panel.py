"""The panel at the right: what everybody needs of what is open; the rest in sections, one level down under "More", and
for who studies light fields another one down, under "Advanced".
"""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from iibr_core.runtime.time_left import about_left
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import Progress, Scene, Source, source_beside
from viewer.model import opening, preferences
from viewer.model.action import Action, do
from viewer.model.commands import BY_NAME
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState, DrawReport
from viewer.model.state.preferences import PARENT_SECTION, SECTIONS, Section, is_seen_open
from viewer.ui.sections.depth_section import depth_line, depth_section
from viewer.ui.sections.essentials import essentials
from viewer.ui.sections.gloss_section import gloss_section
from viewer.ui.sections.inspect import inspect_section
from viewer.ui.sections.lens_section import aperture_section, focus_section, light_section
from viewer.ui.sections.scene_section import scene_section
from viewer.ui.sections.view_section import view_section
from viewer.ui.widgets import button, gap, heading, in_row, last_part, quiet, tooltip

TOOLS = (
    (icons.ICON_FA_IMAGE, "Open", "Open a photo…"),
    (icons.ICON_FA_FLOPPY_DISK, "Save", "Save the picture…"),
    (icons.ICON_FA_SHARE_NODES, "Share", "Share or export…"),
)
"""Icon, word, and the command that it gives."""

FURTHER_TOOLS = (
    (icons.ICON_FA_FOLDER_OPEN, "Open a folder…"),
    (icons.ICON_FA_ROTATE_LEFT, "Undo"),
    (icons.ICON_FA_ROTATE_RIGHT, "Redo"),
    (icons.ICON_FA_CIRCLE_HALF_STROKE, "Light or dark"),
    (icons.ICON_FA_CIRCLE_QUESTION, "Mouse and keys"),
)
READY = "Ready"
HINT = "Drag the picture to look around it, click to focus. Ctrl+Z undoes, F1 shows all keys."
CANCEL_TIP = "Stop here: the picture stays as it is now, and moves less smoothly."
FLAT_HINT = "All of it is equally far away, so nothing moves. Ctrl+Z undoes, F1 shows all keys."
_FIXED = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_collapse
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_nav
    | imgui.WindowFlags_.no_bring_to_front_on_focus
)


def panel(state: AppState, layout: Layout) -> list[Action]:
    """Build the panel; what the user changed comes back as actions."""
    rect = layout.panel
    if not rect.width:
        return []
    imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
    imgui.set_next_window_size(imgui.ImVec2(rect.width, rect.height))
    imgui.begin("panel", None, _FIXED)
    actions = _tools(state, layout)
    if state.scene is None:
        is_reading = bool(progress_text(state.progress))
        actions += _progress(state, layout) if is_reading else _nothing_open(state, layout)
    else:
        actions += _picture(state, state.scene, layout)
    imgui.end()
    return actions


def _nothing_open(state: AppState, layout: Layout) -> list[Action]:
    return _further_tools(state, layout) + _recent(state.recent, state.source, layout)


def _picture(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """What is open, how far the work is, what everybody needs, and the sections."""
    gap(layout, 2)
    imgui.text_wrapped(scene.name)
    depth_line(scene, layout)
    actions = _progress(state, layout)
    gap(layout, 2)
    actions += essentials(state, scene, layout)
    gap(layout, 2)
    quiet(HINT if aperture_limit(scene.grid) else FLAT_HINT)
    gap(layout, 2)
    for section in SECTIONS:
        actions += _section(section, state, scene, layout)
    return actions


def progress_text(progress: Progress) -> str:
    """Return the progress in one short line: "23 of 81 views, about 3 s left", "81 of 81 views, 5 s" at the end; empty
    if nothing was asked for.
    """
    counted = f"{progress.done} of {view_count_text(progress.total)}" if progress.total else ""
    words = progress.doing or counted
    if progress.is_complete:
        return f"{words}, {time_text(progress.seconds)}"
    return f"{words}, {about_left(progress.left_s)}" if progress.left_s is not None else words


def report_text(report: DrawReport, has_all_views: bool) -> str:
    """Say how long drawing took, and whether the picture becomes better: "Drawn in 12 ms, refining". It is final only
    where has_all_views.
    """
    words = f"Drawn in {report.draw_ms:.0f} ms"
    if report.samples >= report.samples_converged:
        return f"{words}, final" if has_all_views else words
    return f"{words}, refining"


def time_text(seconds: float) -> str:
    """Seconds for people: "0.2 s", "12 s", "3 min"."""
    if seconds >= 100:
        return f"{seconds / 60:.0f} min"
    return f"{seconds:.0f} s" if seconds >= 1 else f"{seconds:.1f} s"


def view_count_text(number: int) -> str:
    """A number of views in words: "1 view", "81 views"."""
    return f"{number} view" if number == 1 else f"{number} views"


def state_text(progress: Progress) -> str:
    """The same where the panel's first lines say it: there it is enough to know when all is done."""
    return READY if progress.is_complete else progress_text(progress)


def size_text(scene: Scene) -> str:
    """Return size and views in words: "600 × 400 px, 9 × 9 views"."""
    return f"{scene.width} × {scene.height} px, {scene.grid.rows} × {scene.grid.columns} views"


def _tools(state: AppState, layout: Layout) -> list[Action]:
    """A row of commands by icon and word; what cannot be done now is grey."""
    actions: list[Action] = []
    for (icon, word, name), width in in_row(TOOLS, layout):
        if _tool(f"{icon}  {word}##{name}", name, state, layout, width):
            actions.append(BY_NAME[name].action(state))
    return actions


def _further_tools(state: AppState, layout: Layout) -> list[Action]:
    """The same of those that fewer people look for, by icon alone."""
    actions: list[Action] = []
    for (icon, name), width in in_row(FURTHER_TOOLS, layout):
        if _tool(f"{icon}##{name}", name, state, layout, width):
            actions.append(BY_NAME[name].action(state))
    return actions


def _tool(words: str, name: str, state: AppState, layout: Layout, width: float) -> bool:
    chords = BY_NAME[name].chords
    tip = name.rstrip("…") + (f" ({chords[0].words})" if chords else "")
    return button(words, layout, tip, _is_possible(name, state), width)


def _is_possible(name: str, state: AppState) -> bool:
    needs: dict[str, bool] = {
        "Undo": bool(state.history.past),
        "Redo": bool(state.history.future),
        "Save the picture…": state.scene is not None,
        "Share or export…": state.scene is not None,
    }
    return needs.get(name, True)


def _recent(paths: tuple[str, ...], source: Source | None, layout: Layout) -> list[Action]:
    actions: list[Action] = []
    if paths:
        quiet("Recent")
    for path in paths:
        is_chosen, _ = imgui.selectable(f"{last_part(path)}##{path}", False)
        tooltip(path, layout)
        if is_chosen:
            actions.append(do(opening.open_source, source_beside(source, path)))
    return actions


def _progress(state: AppState, layout: Layout) -> list[Action]:
    """A bar that stays when the work is done, so that nothing below it jumps; a button stops the work."""
    progress = state.progress
    words = state_text(progress)
    if not words:
        return []
    actions: list[Action] = []
    imgui.progress_bar(progress.share, imgui.ImVec2(-1, 4 * layout.ui_scale), "")
    is_working = not progress.is_complete and state.stopped != state.generation
    if is_working:
        if _words_and_button(words, "Cancel", CANCEL_TIP, layout):
            actions.append(do(opening.stop))
    else:
        quiet(words)
    return actions


def _words_and_button(words: str, text: str, tip: str, layout: Layout) -> bool:
    """Quiet words, and a button at the right end of their first line; the words keep clear of it."""
    start, padding = imgui.get_cursor_pos_x(), 2 * imgui.get_style().frame_padding.x
    room = imgui.get_content_region_avail().x - imgui.calc_text_size(text).x - padding
    imgui.set_cursor_pos_x(start + room)
    pressed = imgui.small_button(text)
    tooltip(tip, layout)
    imgui.same_line(start)
    imgui.push_text_wrap_pos(start + room - padding / 2)
    imgui.text_colored(imgui.get_style().color_(imgui.Col_.text_disabled), words)
    imgui.pop_text_wrap_pos()
    return bool(pressed)


def _section(section: Section, state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """A heading that opens and closes what is under it. Where there is one view, focus and aperture mean nothing."""
    sections = state.preferences.open_sections
    if section in PARENT_SECTION and not is_seen_open(PARENT_SECTION[section], sections):
        return []
    if section in ("focus", "aperture", "view") and not aperture_limit(scene.grid):
        return []
    is_open = section in sections
    toggled: list[Action] = (
        [do(preferences.toggle_section, section)] if heading(section.capitalize(), is_open, layout) else []
    )
    return toggled + (BUILDERS[section](state, scene, layout) if is_open else [])


def _recent_elsewhere(state: AppState, layout: Layout) -> list[Action]:
    """Recent files other than the one that is open."""
    others = tuple(path for path in state.recent if state.source is None or path != state.source.path)
    if not others:
        return []
    gap(layout, 2)
    return _recent(others, state.source, layout)


def _more(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Before the sections that lie in it: further tools and what else was open lately."""
    return _further_tools(state, layout) + _recent_elsewhere(state, layout)


def _is_final(state: AppState) -> bool:
    """Return whether no further view can change the picture."""
    is_shown = state.shown_generation == state.generation and state.free_progress is None
    return is_shown and state.progress.is_complete


def _figures(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """How the views are made and drawn, before what else is known of the scene."""
    quiet(size_text(scene))
    quiet(progress_text(state.progress) or "No views asked for.")
    quiet("" if state.report is None else report_text(state.report, _is_final(state)))
    scene_section(state, scene, layout)
    return []


BUILDERS: dict[Section, Callable[[AppState, Scene, Layout], list[Action]]] = {
    "more": _more,
    "view": view_section,
    "focus": focus_section,
    "aperture": aperture_section,
    "light": light_section,
    "gloss": gloss_section,
    "depth": depth_section,
    "advanced": lambda state, scene, layout: [],
    "inspect": inspect_section,
    "scene": _figures,
}
"""What each section shows before those that lie in it."""
