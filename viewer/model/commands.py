"""The commands, by name and key, for the keyboard, the map on F1 and the palette; the action for a chosen path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from iibr_core.depth.editing.edits import BRUSH_TOOLS
from iibr_core.exports.loops import LOOPS, LoopKind
from iibr_core.scenes.scene import Source, source_beside, source_with_map
from viewer.model import (
    depth,
    depth_models,
    folder,
    history,
    inspection,
    lens,
    messages,
    opening,
    preferences,
    saving,
    viewpoint,
    window,
)
from viewer.model.action import Action, ask, do
from viewer.model.demo_photo import demo_photo
from viewer.model.state.app_state import AppState
from viewer.model.state.depth import Tool
from viewer.model.state.depth_models import ModelsPrompt
from viewer.model.state.inspection import COMPARISONS, OVERLAYS, Comparison, OverlayKind
from viewer.model.state.lens import PRESETS
from viewer.model.state.preferences import SECTIONS
from viewer.model.state.prompts import ChoiceOf, PalettePrompt
from viewer.model.state.tasks import ChooseTask, PlainTask
from viewer.model.state.viewpoint import Zoom

FONT_STEP = 1.1
CAMERA_STEP = 0.05
RECENT_SHOWN = 4
KEY_WORDS = {
    "equal": "+",
    "minus": "−",
    "_0": "0",
    "_1": "1",
    "space": "Space",
    "page_down": "Page down",
    "page_up": "Page up",
    "tab": "Tab",
    "backslash": "\\",
}
"""Names of keys for people, by ImGui's names."""
COMPARE_WORDS: dict[Comparison, str] = {
    "photo": "Compare with the photo",
    "snapshot": inspection.COMPARE_SNAPSHOT,
}
BRUSH_WORDS: dict[Tool, str] = {
    "nearer": "Nearer",
    "farther": "Farther",
    "smooth": "Smooth",
    "level": "Level",
    "fill": "Bucket",
    "select": "Select",
}
OVERLAY_WORDS: dict[OverlayKind, str] = {"disparity": "depth", "entropy": "entropy", "inpainted": "inpainting"}
LOOP_WORDS: dict[LoopKind, str] = {"circle": "Circle", "eight": "Figure of eight", "swing": "Swing"}


@dataclass(frozen=True)
class Chord:
    """A key, by ImGui's name, with modifiers."""

    key: str
    ctrl: bool = False
    shift: bool = False

    @property
    def words(self) -> str:
        """The chord for people: "Ctrl+Shift+Z"."""
        key = KEY_WORDS.get(self.key, self.key.upper())
        return "Ctrl+" * self.ctrl + "Shift+" * self.shift + key


@dataclass(frozen=True)
class Command:
    """One thing that can be done.

    action: returns the action for a state. repeats: while the key is held.
    """

    name: str
    action: Callable[[AppState], Action]
    chords: tuple[Chord, ...] = ()
    repeats: bool = False


def _always(action: Action) -> Callable[[AppState], Action]:
    return lambda state: action


def _scale_text(factor: float) -> Callable[[AppState], Action]:
    return lambda state: do(preferences.set_font_scale, state.preferences.font_scale * factor)


def _toggle_help(state: AppState) -> Action:
    return do(messages.show_prompt, None if state.prompt == "help" else "help")


def _toggle_palette(state: AppState) -> Action:
    return do(messages.show_prompt, None if isinstance(state.prompt, PalettePrompt) else PalettePrompt())


def _toggle_overlay(kind: OverlayKind) -> Callable[[AppState], Action]:
    return lambda state: do(inspection.set_overlay, None if state.inspection.overlay == kind else kind)


def _toggle_comparison(kind: Comparison) -> Callable[[AppState], Action]:
    return lambda state: do(inspection.compare, None if state.inspection.comparison == kind else kind)


def _toggle_brush(state: AppState) -> Action:
    return do(depth.set_brush, replace(state.brush, is_on=not state.brush.is_on))


def _own_pixels(state: AppState) -> Action:
    """Return the zoom to 1:1 about the pointer if it is over the picture, else about the middle."""
    scene, hover, centre = state.scene, state.hover, (0.5, 0.5) if state.zoom is None else state.zoom.centre
    if scene is not None and hover is not None and state.zoom is None:
        centre = (hover.x_px + 0.5) / scene.width, (hover.y_px + 0.5) / scene.height
    return do(viewpoint.set_zoom, Zoom(1.0, centre))


def _brush_with(tool: Tool) -> Callable[[AppState], Action]:
    return lambda state: do(depth.set_brush, replace(state.brush, tool=tool, is_on=True))


def _invert_depth(state: AppState) -> Action:
    edits = state.depth.edits
    return do(depth.set_tone, replace(edits, is_inverted=not edits.is_inverted), is_finished=True)


COMMANDS: tuple[Command, ...] = (
    Command("Open a photo…", _always(do(ask, ChooseTask("photo"))), (Chord("o", ctrl=True),)),
    Command("Open a folder…", _always(do(ask, ChooseTask("folder"))), (Chord("o", ctrl=True, shift=True),)),
    Command("See the demo", lambda state: do(opening.open_source, Source(str(demo_photo())))),
    Command("Save the picture…", _always(do(saving.ask_to_save)), (Chord("s", ctrl=True),)),
    Command("Copy the picture", _always(do(ask, PlainTask("copy"))), (Chord("c", ctrl=True),)),
    Command("Paste a picture, or the path of one", _always(do(ask, PlainTask("paste"))), (Chord("v", ctrl=True),)),
    Command("Next photo of the folder", _always(do(folder.step, 1)), (Chord("page_down"),), repeats=True),
    Command("Previous photo of the folder", _always(do(folder.step, -1)), (Chord("page_up"),), repeats=True),
    Command(
        "Filmstrip",
        lambda state: do(preferences.show_filmstrip, not state.preferences.shows_filmstrip),
        (Chord("f"),),
    ),
    Command("Photos by name", _always(do(folder.set_order, "name"))),
    Command("Photos by time", _always(do(folder.set_order, "time"))),
    Command("Share or export…", _always(do(saving.ask_to_export)), (Chord("e", ctrl=True),)),
    Command("Exports…", _always(do(messages.show_prompt, "exports"))),
    Command("Undo", _always(do(history.undo)), (Chord("z", ctrl=True),), repeats=True),
    Command(
        "Redo", _always(do(history.redo)), (Chord("z", ctrl=True, shift=True), Chord("y", ctrl=True)), repeats=True
    ),
    Command("Reset viewpoint, focus and aperture", _always(do(lens.reset)), (Chord("r"),)),
    Command("Recenter", _always(do(viewpoint.return_home)), (Chord("c"),)),
    *(Command(f"Preset: {name}", _always(do(lens.apply_preset, name))) for name in PRESETS),
    *(Command(f"Motion: {LOOP_WORDS[kind].lower()}", _always(do(viewpoint.set_loop, kind))) for kind in LOOPS),
    Command(
        "Motion: pause or resume", lambda state: do(viewpoint.pause, not state.motion.is_paused), (Chord("space"),)
    ),
    Command("Motion: stop", _always(do(viewpoint.set_loop, None))),
    Command("Rack focus", _always(do(viewpoint.rack_focus)), (Chord("x"),)),
    Command("Step forward", _always(do(viewpoint.move_camera, forward=CAMERA_STEP)), (Chord("w"),), repeats=True),
    Command("Step back", _always(do(viewpoint.move_camera, forward=-CAMERA_STEP)), (Chord("s"),), repeats=True),
    Command("Look up", _always(do(viewpoint.move_camera, down=-CAMERA_STEP)), (Chord("w", shift=True),), repeats=True),
    Command("Look down", _always(do(viewpoint.move_camera, down=CAMERA_STEP)), (Chord("s", shift=True),), repeats=True),
    Command(
        "Look left", _always(do(viewpoint.move_camera, right=-CAMERA_STEP)), (Chord("a", shift=True),), repeats=True
    ),
    Command(
        "Look right", _always(do(viewpoint.move_camera, right=CAMERA_STEP)), (Chord("d", shift=True),), repeats=True
    ),
    Command("Tilt handles", lambda state: do(lens.show_tilt_handles, state.tilt_handles is None), (Chord("t"),)),
    Command("Depth brush", _toggle_brush, (Chord("b"),)),
    *(Command(f"Depth brush: {BRUSH_WORDS[tool].lower()}", _brush_with(tool)) for tool in BRUSH_TOOLS),
    Command("Select a subject", _brush_with("select")),
    Command("Invert depth", _invert_depth),
    Command("Reset depth edits", _always(do(depth.reset))),
    Command("Open a depth map…", _always(do(ask, ChooseTask("map")))),
    Command("Get better depth", _always(do(depth_models.get_depth))),
    Command("Depth models…", _always(do(messages.show_prompt, ModelsPrompt()))),
    Command("Save the depth map…", _always(do(saving.ask_to_save, "map"))),
    Command("EPI strips", lambda s: do(inspection.show_epis, not s.inspection.shows_epis), (Chord("e"),)),
    Command("All views", lambda s: do(inspection.show_views, not s.inspection.shows_views), (Chord("g"),)),
    Command(
        "Values under the pointer",
        lambda s: do(inspection.show_values, not s.inspection.shows_values),
        (Chord("v"),),
    ),
    *(
        Command(f"Overlay: {OVERLAY_WORDS[kind]}", _toggle_overlay(kind), (Chord("d"),) if kind == "disparity" else ())
        for kind in OVERLAYS
    ),
    *(
        Command(COMPARE_WORDS[kind], _toggle_comparison(kind), (Chord("p"),) if kind == "photo" else ())
        for kind in COMPARISONS
    ),
    Command("Stop making views", _always(do(opening.stop))),
    Command("Zoom: the whole picture", _always(do(viewpoint.set_zoom, None)), (Chord("_0"),)),
    Command("Zoom: the photo's own pixels, 1:1", _own_pixels, (Chord("_1"),)),
    *(Command(f"Section: {section}", _always(do(preferences.toggle_section, section))) for section in SECTIONS),
    Command("Full screen", lambda s: do(window.set_fullscreen, not s.is_fullscreen), (Chord("f11"),)),
    Command("Hide or show the panel", _always(do(window.toggle_panel)), (Chord("tab"),)),
    Command("Before and after", lambda s: do(lens.show_before, not s.shows_before), (Chord("backslash"),)),
    Command("Take a snapshot", _always(do(inspection.take_snapshot)), (Chord("k"),)),
    Command(
        "Light or dark", lambda s: do(preferences.set_theme, "dark" if s.preferences.theme == "light" else "light")
    ),
    Command(
        "Units: a photographer's or a light field's",
        lambda s: do(preferences.set_units, "photographic" if s.preferences.units == "light field" else "light field"),
    ),
    Command(
        "Larger text",
        _scale_text(FONT_STEP),
        (Chord("equal", ctrl=True), Chord("equal", ctrl=True, shift=True)),
        repeats=True,
    ),
    Command("Smaller text", _scale_text(1 / FONT_STEP), (Chord("minus", ctrl=True),), repeats=True),
    Command("Reset text size", _always(do(preferences.set_font_scale, 1.0)), (Chord("_0", ctrl=True),)),
    Command("All commands", _toggle_palette, (Chord("p", ctrl=True),)),
    Command("Mouse and keys", _toggle_help, (Chord("f1"),)),
    Command("Quit", _always(do(saving.quit_window)), (Chord("q", ctrl=True),)),
)
BY_NAME = {command.name: command for command in COMMANDS}


def commands_matching(text: str, recent: tuple[Command, ...] = ()) -> tuple[Command, ...]:
    """Return the commands whose names hold all words of a text, recent commands first."""
    words = text.lower().split()
    return tuple(command for command in (*recent, *COMMANDS) if all(word in command.name.lower() for word in words))


def recent_commands(state: AppState) -> tuple[Command, ...]:
    """Return commands that open recent files, the latest first."""
    paths = opening.other_recent(state)[:RECENT_SHOWN]
    return tuple(
        Command(f"Open {name}", _always(do(opening.open_source, source_beside(state.source, path))))
        for path, name in zip(paths, opening.names_of(paths))
    )


def action_for_path(what: ChoiceOf, path: str, state: AppState) -> Action:
    """Return the action for a path that the user chose."""
    match what:
        case "mask":
            return do(ask, PlainTask("read mask", path))
        case "map" if state.source is not None:
            return do(opening.open_source, source_with_map(state.source, path))
        case "model" | "model folder" if state.source is not None:
            return do(depth_models.use_model, path)
    return do(opening.open_source, source_beside(state.source, path))
