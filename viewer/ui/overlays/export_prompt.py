"""The prompt of an export: its purpose, the kinds for this purpose, and the options of the kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import TOLERANCE_LIMITS
from iibr_core.exports import kinds
from iibr_core.exports.kinds import EXPORTS, AnimationKind, DepthLayout, ExportKind, ExportOptions, Purpose
from iibr_core.formats.quilts import DEVICES
from iibr_core.scenes.lens_limits import clamp, focus_span
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, InputError
from viewer.model import messages, saving
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.preferences import is_seen_open
from viewer.model.saving import ExportPrompt
from viewer.ui.overlays.prompt_rows import WIDTH_FIELD, choice_row, place_actions, place_row, size_row, text_field
from viewer.ui.widgets import checkbox, choices, gap, label, percent_slider, quiet, scale, slider

ADVANCED_ROWS = ("keys",)
"""Rows that are shown once the panel's advanced section was opened."""
ANY_DISPLAY = "any"
MIN_SPAN_PX = 1e-3
"""Smallest span of disparity that 3D strength counts with, in pixels per view step."""
PICTURE, PICTURE_ENTRY = "picture", ("Picture: PNG, JPEG, …", "The picture as it looks now, at any size.")
PURPOSE_TIPS: dict[Purpose, str] = {
    "share": "Files that everyone can view without this program.",
    "display": "For light-field displays, headsets, 3D televisions and glasses.",
    "software": "Views, cameras, depth and splats for other programs.",
}
MOTION_TIPS: dict[AnimationKind, str] = {
    "circle": "The viewpoint moves in a circle.",
    "eight": "The viewpoint moves along a lying eight.",
    "swing": "The viewpoint swings from left to right and back.",
    "focus": "The focus moves from near to far and back.",
    "rack": "The focus glides from your last click but one to your last click, and back.",
    "aperture": "The aperture closes and opens again.",
}


@dataclass(frozen=True)
class _Export:
    """Data for the rows. picked: place (x, y) that was clicked last, in pixels of the photo, None without."""

    kind: ExportKind
    scene: Scene
    optics: Optics
    picked: tuple[float, float] | None = None


Row = Callable[[ExportOptions, _Export], Any]
"""Function that draws a row for an option and returns its value, changed by the user or not."""


def export_prompt(prompt: ExportPrompt, state: AppState) -> list[Action]:
    """Draw the prompt; return the actions of the user."""
    assert state.scene is not None
    imgui.text("Share or export")
    if state.files or state.jobs:
        imgui.same_line()
        if imgui.small_button("Saved files…"):
            return [do(messages.show_prompt, "files")]
    gap()
    chosen = _kind_rows(prompt.kind)
    if chosen == PICTURE:
        return [do(saving.ask_to_save)]
    actions: list[Action] = []
    if chosen != prompt.kind:  # its rows are drawn at once: a frame without them would flicker
        prompt = saving.as_other_kind(state, prompt, chosen)
        actions = [do(messages.show_prompt, prompt)]
    kind, scene = EXPORTS[chosen], state.scene
    is_advanced = is_seen_open("advanced", state.preferences.open_sections)
    edited = replace(
        prompt,
        options=_option_rows(
            prompt.options, _Export(kind, scene, state.optics, saving.picked_place(state)), is_advanced
        ),
    )
    row_of_path = place_row("File" if kind.endings else "Folder", prompt.path, state, prompt.problem)
    written = _written_name(kind, edited, scene)
    if written and written != Path(prompt.path.strip()).name:
        quiet(f"The file name becomes {written}{', for programs that read it.' if kind.path else '.'}")
    return actions + place_actions(prompt, edited, row_of_path, "Export", state, written)


def _kind_rows(kind: str) -> str:
    """Draw one button per purpose, and the list of its kinds; return the chosen kind, or PICTURE for its own prompt."""
    label("For")
    usual = EXPORTS[kind].purpose
    purposes = {purpose: (words, PURPOSE_TIPS[purpose]) for purpose, words in kinds.PURPOSES.items()}
    purpose = choices(purposes, [usual]) or usual
    entries = {name: (kind.words, _files_of(kind)) for name, kind in saving.kinds_for(purpose).items()}
    entries |= {PICTURE: PICTURE_ENTRY} if purpose == "share" else {}
    label("As")
    return choice_row("kind", kind if purpose == usual else saving.first_kind(purpose), entries)


def _files_of(kind: ExportKind) -> str:
    return f"One file: {', '.join(kind.endings)}" if kind.endings else "A folder of files."


def _option_rows(options: ExportOptions, export: _Export, is_advanced: bool) -> ExportOptions:
    """Draw the rows of the kind; return the options. An option that was not changed keeps following its default."""
    filled = edited = kinds.with_defaults(export.kind, options, export.scene, export.optics)
    for name, row in ROWS.items():
        if name in export.kind.supports and (is_advanced or name not in ADVANCED_ROWS):
            edited = replace(edited, **{name: row(edited, export)})
    if edited.rate != filled.rate:  # the length stays
        edited = replace(edited, frames=_frames_in(filled.frames / filled.rate, edited.rate))
    values = {field.name: getattr(edited, field.name) for field in fields(edited)}
    return replace(options, **{name: value for name, value in values.items() if value != getattr(filled, name)})


def _written_name(kind: ExportKind, prompt: ExportPrompt, scene: Scene) -> str:
    """Return the name of the file that will be written, "" if there is none yet."""
    try:
        return saving.written_path(kind, prompt.path, scene, prompt.options).name
    except InputError:
        return ""


def _device(options: ExportOptions, export: _Export) -> str | None:
    label("Made for", "The display. For any display, the pictures keep the photo's shape.")
    entries = {ANY_DISPLAY: (ANY_DISPLAY, "The photo's shape.")}
    for name, quilt in DEVICES.items():
        size = f"{quilt.size.width} x {quilt.size.height} pixels"
        entries[name] = (name, f"{quilt.columns} x {quilt.rows} views in a picture of {size}.")
    device = choice_row("device", options.device or ANY_DISPLAY, entries)
    return None if device == ANY_DISPLAY else device


def _motion(options: ExportOptions, export: _Export) -> AnimationKind:
    label("Motion", "What moves. The end meets the beginning, so it can loop.")
    return choice_row(
        "motion", options.motion, {name: (name.capitalize(), MOTION_TIPS[name]) for name in kinds.ANIMATIONS}
    )


def _keys(options: ExportOptions, export: _Export) -> Path | None:
    label("Camera path", "A text file with a line for each place: s t, s t focus, or s t focus aperture.")
    text, _ = text_field("keys", str(options.keys or ""), "a text file, instead of the motion above")
    return Path(text) if text.strip() else None


def _eyes(options: ExportOptions, export: _Export) -> float:
    scene, (far, near) = export.scene, export.scene.disparity_range_px
    percent = 100 * max(near - far, MIN_SPAN_PX) / scene.width  # of the width, for eyes one view apart
    tip = "How far the nearest moves against the farthest, of the width. What is in focus lies on the screen."
    limits = 0.0, max(scene.grid.columns - 1, 1)
    return slider("3D strength", options.eyes, limits, "%.1f %%", tip, unit=1 / percent)


def _grid(options: ExportOptions, export: _Export) -> GridShape | None:
    label("Views", "Number of views a side. More make smaller steps between the same outermost views.")
    scene, grid = export.scene, options.grid or export.scene.grid
    size = f"of {scene.width} x {scene.height} pixels"
    if scene.plan is None:
        imgui.text(f"{grid.rows} x {grid.columns} {size}")
        return options.grid
    imgui.set_next_item_width(WIDTH_FIELD * scale())
    changed, side = imgui.input_int("##views", grid.columns, 0, 0)
    imgui.same_line()
    imgui.text(f"x {grid.rows} {size}")
    side = min(max(side, 1), kinds.MAX_SIDE_VIEWS)
    return GridShape(side, side) if changed else options.grid


def _row(options: ExportOptions, export: _Export) -> int:
    limits = 0, export.scene.height - 1
    return round(slider("Row", options.row, limits, "%.0f", "Row of the picture, counted from the top."))


def _size(options: ExportOptions, export: _Export) -> ScreenSize:
    width = size_row(options.size)
    aspect = kinds.picture_aspect(export.kind, options.eyes, export.scene, export.optics)
    return options.size if width is None else kinds.size_of_width(export.kind, aspect, width)


def _frames(options: ExportOptions, export: _Export) -> int:
    """Draw the number of pictures, or the length of an animation in seconds."""
    if export.kind.rate:
        label("Length", "Time until it begins again.")
        changed, seconds = imgui.input_float("##seconds", options.frames / options.rate, 0, 0, "%.4g s")
        return _frames_in(seconds, options.rate) if changed else options.frames
    label("Pictures", "Number of pictures from near to far.")
    changed, frames = imgui.input_int("##frames", options.frames, 0, 0)
    return min(max(frames, 1), kinds.MAX_FRAMES) if changed else options.frames


def _rate(options: ExportOptions, export: _Export) -> float:
    label("Frame rate", f"Frames per second; {options.frames} frames in all.")
    changed, rate = imgui.input_float("##rate", options.rate, 0, 0, "%.4g fps")
    return clamp(rate, *kinds.RATE_LIMITS) if changed and math.isfinite(rate) else options.rate


def _frames_in(seconds: float, rate: float) -> int:
    """Return the number of frames, at least two so that something moves."""
    return round(clamp(seconds * rate if math.isfinite(seconds) else 0.0, 2, kinds.MAX_FRAMES))


def _layout(options: ExportOptions, export: _Export) -> DepthLayout:
    label("Depth", "Place of the depth beside the picture.")
    return choice_row("layout", options.layout, {name: (name.capitalize(), "") for name in kinds.DEPTH_LAYOUTS})


def _bits(options: ExportOptions, export: _Export) -> int:
    label("Bits", "Bits per colour channel. 16 keep fine gradients for editing.")
    return int(choice_row("bits", str(options.bits), {str(bits): (f"{bits} bits", "") for bits in kinds.STACK_BITS}))


def _show(options: ExportOptions, export: _Export) -> bool:
    label("Display")
    return checkbox(
        "show it there when it is written", options.show, "Needs Looking Glass Bridge, the display's program."
    )


def _budget(options: ExportOptions, export: _Export) -> int | None:
    label("Size limit", "Largest file size. Pictures lose detail or views are left out. 0 for no limit.")
    form = "%.4g MB" if options.budget else "none"
    changed, megabytes = imgui.input_float("##budget", (options.budget or 0) / 1e6, 0, 0, form)
    return int(clamp(megabytes, 0, 1000) * 1e6) or None if changed else options.budget


def _credit(options: ExportOptions, export: _Export) -> bool:
    label("Metadata")
    tip = "As the photo's file states them. The location is left out."
    return checkbox("title, author, copyright", options.credit, tip)


def _at(options: ExportOptions, export: _Export) -> tuple[float, float] | None:
    label("Surface", "Click a surface in the picture, or select it, before you export.")
    place = export.picked
    quiet("none was clicked yet" if place is None else f"the one at {place[0]:.0f}, {place[1]:.0f}, clicked last")
    return place


def _tolerance(options: ExportOptions, export: _Export) -> float:
    tip = "Contrast that ends the surface: higher values take in more."
    return percent_slider("Tolerance", options.tolerance, tip, True, TOLERANCE_LIMITS, is_logarithmic=True)


def _soft(options: ExportOptions, export: _Export) -> float:
    span, tip = focus_span(export.scene), "How softly the mask ends before and behind the range in focus."
    return slider("Soft ends", options.soft, (0.0, span), "%.0f %%", tip, unit=span / 100)


ROWS: dict[str, Row] = {
    "at": _at,
    "tolerance": _tolerance,
    "soft": _soft,
    "device": _device,
    "motion": _motion,
    "keys": _keys,
    "eyes": _eyes,
    "row": _row,
    "grid": _grid,
    "size": _size,
    "frames": _frames,
    "rate": _rate,
    "layout": _layout,
    "bits": _bits,
    "show": _show,
    "budget": _budget,
    "credit": _credit,
}
"""Rows from top to bottom, by the names in `ExportKind.supports`."""
