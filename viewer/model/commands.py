"""The commands, by name and key, for the keyboard, the map on F1 and the palette; the action for a chosen path."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

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
    look,
    messages,
    opening,
    preferences,
    saving,
    stereo,
    tracking,
    viewpoint,
    window,
)
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.demo_photo import demo_photo
from viewer.model.depth import TOOLS, Tool
from viewer.model.inspection import COMPARISONS, OVERLAYS, Comparison, OverlayKind
from viewer.model.layout import Zoom
from viewer.model.preferences import SECTIONS
from viewer.model.presets import PRESETS
from viewer.model.stereo import STEREO_MODES, StereoMode
from viewer.model.tasks import ChoiceOf, ChooseTask, PlainTask, ask


@dataclass(frozen=True)
class PalettePrompt:
    """The list of commands, narrowed down by the typed text. selected: index of the one that Enter runs."""

    text: str = ""
    selected: int = 0


FONT_STEP = 1.1
CAMERA_STEP = 0.05
RECENT_SHOWN = 4
KEY_WORDS = {"equal": "+", "minus": "−", "backslash": "\\"}
"""Names of keys for people where they differ from ImGui's names."""
COMPARE_WORDS: dict[Comparison, str] = {"photo": "Compare with the photo", "snapshot": inspection.COMPARE_SNAPSHOT}
BRUSH_WORDS: dict[Tool, str] = {**{tool: tool.capitalize() for tool in TOOLS}, "fill": "Bucket"}
OVERLAY_WORDS: dict[OverlayKind, str] = {"disparity": "depth", "entropy": "entropy", "inpainted": "inpainting"}
LOOP_WORDS: dict[LoopKind, str] = {"circle": "Circle", "eight": "Figure of eight", "swing": "Swing"}

STEREO_WORDS: dict[StereoMode, tuple[str, str]] = {
    "half-sbs": ("Side by side, half", "3D televisions and projectors"),
    "sbs": ("Side by side, full", "displays that weave any full-screen pair, and screens twice as wide"),
    "top-bottom": ("One above the other", "3D televisions and projectors"),
    "rows": ("In turns by rows", "displays for polarised glasses"),
    "columns": ("In turns by columns", "displays with a parallax barrier"),
    "checkerboard": ("Checkerboard", "3D televisions of the DLP kind"),
    "anaglyph": ("Anaglyph", "red-cyan glasses on any display"),
    "cross-eyed": ("Cross-eyed", "eyes that cross, on any display"),
}
"""Name of each arrangement for people, and what it is for."""


@dataclass(frozen=True)
class Chord:
    """A key, by ImGui's name, with modifiers."""

    key: str
    ctrl: bool = False
    shift: bool = False

    @property
    def words(self) -> str:
        """The chord for people: "Ctrl+Shift+Z"."""
        key = KEY_WORDS.get(self.key, self.key.strip("_").replace("_", " ").capitalize())
        return "Ctrl+" * self.ctrl + "Shift+" * self.shift + key


@dataclass(frozen=True)
class Command:
    """One thing that can be done.

    does: the action, or a function that returns it for a state. keys: chords such as "ctrl+shift+z", with spaces
    between them. repeats: while the key is held.
    """

    name: str
    does: Action | Callable[[AppState], Action]
    keys: str = ""
    repeats: bool = False

    def action(self, state: AppState) -> Action:
        """Return the action in a state."""
        return self.does if isinstance(self.does, Action) else self.does(state)

    @cached_property
    def chords(self) -> tuple[Chord, ...]:
        """The chords that give the command."""
        parts = [chord.split("+") for chord in self.keys.split()]
        return tuple(Chord(key, "ctrl" in modifiers, "shift" in modifiers) for *modifiers, key in parts)


def _scale_text(factor: float) -> Callable[[AppState], Action]:
    return lambda state: do(preferences.set_font_scale, state.preferences.font_scale * factor)


def _toggle_overlay(kind: OverlayKind) -> Callable[[AppState], Action]:
    return lambda state: do(inspection.set_overlay, None if state.inspection.overlay == kind else kind)


def _toggle_comparison(kind: Comparison) -> Callable[[AppState], Action]:
    return lambda state: do(inspection.compare, None if state.inspection.comparison == kind else kind)


def _brush_with(tool: Tool) -> Callable[[AppState], Action]:
    return lambda state: do(depth.set_brush, replace(state.brush, tool=tool, is_on=True))


def _toggle_palette(state: AppState) -> Action:
    return do(messages.show_prompt, None if isinstance(state.prompt, PalettePrompt) else PalettePrompt())


def _zoom_to_pixels(state: AppState) -> Action:
    """Return the zoom to 1:1 about the pointer if it is over the picture, else about the middle."""
    scene, hover, centre = state.scene, state.hover, (0.5, 0.5) if state.zoom is None else state.zoom.centre
    if scene is not None and hover is not None and state.zoom is None:
        centre = (hover.x_px + 0.5) / scene.width, (hover.y_px + 0.5) / scene.height
    return do(viewpoint.set_zoom, Zoom(1.0, centre))


def _invert_depth(state: AppState) -> Action:
    edits = state.depth.edits
    return do(depth.set_tone, replace(edits, is_inverted=not edits.is_inverted), is_finished=True)


COMMANDS: tuple[Command, ...] = (
    Command("Open a photo…", do(ask, ChooseTask("photo")), "ctrl+o"),
    Command("Open a folder…", do(ask, ChooseTask("folder")), "ctrl+shift+o"),
    Command("See the demo", lambda s: do(opening.open_source, Source(str(demo_photo())))),
    Command("Save the picture…", do(saving.ask_to_save), "ctrl+s"),
    Command("Copy the picture", do(ask, PlainTask("copy")), "ctrl+c"),
    Command("Paste a picture, or the path of one", do(ask, PlainTask("paste")), "ctrl+v"),
    Command("Copy the look", do(look.copy_look), "ctrl+shift+c"),
    Command("Paste the look", do(look.paste_look), "ctrl+shift+v"),
    Command("Next photo of the folder", do(folder.step, 1), "page_down", repeats=True),
    Command("Previous photo of the folder", do(folder.step, -1), "page_up", repeats=True),
    Command("Filmstrip", lambda s: do(preferences.show_filmstrip, not s.preferences.shows_filmstrip), "f"),
    Command("Photos by name", do(folder.set_order, "name")),
    Command("Photos by time", do(folder.set_order, "time")),
    Command("Share or export…", do(saving.ask_to_export), "ctrl+e"),
    Command("Saved files…", do(messages.show_prompt, "files")),
    Command("Undo", do(history.undo), "ctrl+z", repeats=True),
    Command("Redo", do(history.redo), "ctrl+shift+z ctrl+y", repeats=True),
    Command("Reset viewpoint, focus and aperture", do(lens.reset), "r"),
    Command("Recenter", do(viewpoint.return_home), "c"),
    Command("Follow the head", lambda s: do(tracking.switch, None if s.tracking else s.preferences.tracker), "h"),
    Command("Centre the head", do(viewpoint.return_home)),
    *(Command(f"Preset: {name}", do(lens.apply_preset, name)) for name in PRESETS),
    *(Command(f"Motion: {LOOP_WORDS[kind].lower()}", do(viewpoint.set_loop, kind)) for kind in LOOPS),
    Command("Motion: pause or resume", lambda s: do(viewpoint.pause, not s.motion.is_paused), "space"),
    Command("Motion: stop", do(viewpoint.set_loop, None)),
    Command("Rack focus", do(viewpoint.rack_focus), "x"),
    Command("Step forward", do(viewpoint.move_camera, forward=CAMERA_STEP), "w", repeats=True),
    Command("Step back", do(viewpoint.move_camera, forward=-CAMERA_STEP), "s", repeats=True),
    Command("Look up", do(viewpoint.move_camera, down=-CAMERA_STEP), "shift+w", repeats=True),
    Command("Look down", do(viewpoint.move_camera, down=CAMERA_STEP), "shift+s", repeats=True),
    Command("Look left", do(viewpoint.move_camera, right=-CAMERA_STEP), "shift+a", repeats=True),
    Command("Look right", do(viewpoint.move_camera, right=CAMERA_STEP), "shift+d", repeats=True),
    Command("Tilt handles", lambda s: do(lens.show_tilt_handles, s.tilt_handles is None), "t"),
    Command("Depth brush", lambda s: do(depth.set_brush, replace(s.brush, is_on=not s.brush.is_on)), "b"),
    *(Command(f"Depth brush: {BRUSH_WORDS[tool].lower()}", _brush_with(tool)) for tool in BRUSH_TOOLS),
    Command("Select a subject", _brush_with("select")),
    Command("Invert depth", _invert_depth),
    Command("Reset depth edits", do(depth.reset)),
    Command("Open a depth map…", do(ask, ChooseTask("map"))),
    Command("Get better depth", do(depth_models.get_depth)),
    Command("Depth models…", do(depth_models.show_models)),
    Command("Save the depth map…", do(saving.ask_to_save, "map")),
    Command("EPI strips", lambda s: do(inspection.show_epis, not s.inspection.shows_epis), "e"),
    Command("All views", lambda s: do(inspection.show_views, not s.inspection.shows_views), "g"),
    Command("Values under the pointer", lambda s: do(inspection.show_values, not s.inspection.shows_values), "v"),
    *(
        Command(f"Overlay: {OVERLAY_WORDS[kind]}", _toggle_overlay(kind), "d" if kind == "disparity" else "")
        for kind in OVERLAYS
    ),
    *(Command(COMPARE_WORDS[kind], _toggle_comparison(kind), "p" if kind == "photo" else "") for kind in COMPARISONS),
    Command("Stop making views", do(opening.stop)),
    Command("Zoom: the whole picture", do(viewpoint.set_zoom, None), "_0"),
    Command("Zoom: the photo's own pixels, 1:1", _zoom_to_pixels, "_1"),
    *(Command(f"Section: {section}", do(preferences.toggle_section, section)) for section in SECTIONS),
    Command("Full screen", lambda s: do(window.set_fullscreen, not s.is_fullscreen), "f11"),
    Command("Hide or show the panel", do(window.toggle_panel), "tab"),
    Command("Stereo display", lambda s: do(stereo.show, not s.stereo.is_shown), "_3"),
    Command("Stereo display: swap the eyes", do(stereo.swap_eyes), "l"),
    Command("Stereo display: Looking Glass", do(ask, PlainTask("find display"))),
    *(Command(f"Stereo display: {STEREO_WORDS[mode][0].lower()}", do(stereo.set_mode, mode)) for mode in STEREO_MODES),
    Command("Before and after", lambda s: do(lens.show_before, not s.shows_before), "backslash"),
    Command("Take a snapshot", do(inspection.take_snapshot), "k"),
    Command(
        "Light or dark", lambda s: do(preferences.set_theme, "dark" if s.preferences.theme == "light" else "light")
    ),
    Command(
        "Units: a photographer's or a light field's",
        lambda s: do(preferences.set_units, "photographic" if s.preferences.units == "light field" else "light field"),
    ),
    Command("Larger text", _scale_text(FONT_STEP), "ctrl+equal ctrl+shift+equal", repeats=True),
    Command("Smaller text", _scale_text(1 / FONT_STEP), "ctrl+minus", repeats=True),
    Command("Reset text size", do(preferences.set_font_scale, 1.0), "ctrl+_0"),
    Command("All commands", _toggle_palette, "ctrl+p"),
    Command("Mouse and keys", lambda s: do(messages.show_prompt, None if s.prompt == "help" else "help"), "f1"),
    Command("About iibr", do(messages.show_prompt, "about")),
    Command("Quit", do(saving.quit_window), "ctrl+q"),
)
BY_NAME = {command.name: command for command in COMMANDS}


def commands_matching(text: str, recent: tuple[Command, ...] = ()) -> tuple[Command, ...]:
    """Return the commands whose names hold all words of a text, recent commands first; beginnings of names win, then
    those of words.
    """
    words = text.lower().split()

    def is_inside(command: Command) -> tuple[bool, bool]:
        name = command.name.lower()
        return not name.startswith(" ".join(words)), not all(f" {word}" in f" {name}" for word in words)

    found = (command for command in (*recent, *COMMANDS) if all(word in command.name.lower() for word in words))
    return tuple(sorted(found, key=is_inside))


def recent_commands(state: AppState) -> tuple[Command, ...]:
    """Return commands that open recent files, the latest first."""
    paths = opening.other_recent(state)[:RECENT_SHOWN]
    return tuple(
        Command(f"Open {name}", do(opening.open_source, source_beside(state.source, path)))
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
            return do(depth_models.use_model, os.path.abspath(os.path.expanduser(path)))
    return do(opening.open_source, source_beside(state.source, path))
