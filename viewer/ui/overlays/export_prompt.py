"""The prompt of an export: its purpose, the kinds for this purpose, and the options of the kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from imgui_bundle import imgui

from iibr_core.exports.kinds import (
    ANIMATIONS,
    DEPTH_LAYOUTS,
    EXPORTS,
    MAX_FRAMES,
    PURPOSES,
    RATE_LIMITS,
    STACK_BITS,
    AnimationKind,
    ExportKind,
    ExportOptions,
    Purpose,
    picture_aspect,
    size_of_width,
    with_defaults,
)
from iibr_core.formats.quilts import DEVICES
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.scene import Scene
from iibr_core.types import InputError
from viewer.model import messages, saving
from viewer.model.action import Action, do
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.preferences import is_seen_open
from viewer.model.state.prompts import ExportPrompt
from viewer.model.state.tasks import ExportTask
from viewer.ui.overlays.prompt_rows import choice_row, place_actions, place_row, size_row, text_field
from viewer.ui.widgets import checkbox, choice, gap, in_row, label, quiet, slider, whole_slider

ADVANCED_ROWS = ("keys",)
"""Rows that are shown once the panel's advanced section was opened."""
ANY_DISPLAY = "any"
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
class _Shown:
    """Data for the rows. options: with the defaults of the kind. aspect: width / height of each picture."""

    kind: ExportKind
    scene: Scene
    options: ExportOptions
    aspect: float
    layout: Layout


Row = Callable[[ExportOptions, _Shown], ExportOptions]
"""Function that draws a row and returns the options as the user changed them."""


def export_prompt(prompt: ExportPrompt, state: AppState, layout: Layout) -> list[Action]:
    """Draw the prompt; return the actions of the user."""
    assert state.scene is not None
    imgui.text("Share or export")
    if state.exports or state.jobs:
        imgui.same_line()
        if imgui.small_button("Exports…"):
            return [do(messages.show_prompt, "exports")]
    gap(layout, 2)
    purpose = _purpose_row(EXPORTS[prompt.kind].purpose, layout)
    label("As", layout)
    chosen = prompt.kind if purpose == EXPORTS[prompt.kind].purpose else saving.first_kind(purpose)
    chosen = choice_row("kind", chosen, _entries(purpose), layout)
    if chosen == PICTURE:
        return [do(saving.ask_to_save)]
    if chosen != prompt.kind:
        return [do(messages.show_prompt, saving.as_other_kind(state, prompt, chosen))]
    kind, options, sections = EXPORTS[chosen], prompt.options, state.preferences.open_sections
    filled = with_defaults(kind, options, state.scene, state.optics)
    aspect = picture_aspect(kind, filled.eyes, state.scene, state.optics)
    shown = _Shown(kind, state.scene, filled, aspect, layout)
    for name, row in ROWS.items():
        if name in kind.supports and (name not in ADVANCED_ROWS or is_seen_open("advanced", sections)):
            options = row(options, shown)
    if kind.is_light_field:
        _say_views(state.scene, layout)
    row_of_path = place_row("File" if kind.endings else "Folder", prompt.path, state, layout)
    edited = replace(prompt, options=options)
    written = _written_name(kind, edited, state.scene)
    if written and written != Path(prompt.path.strip()).name:
        quiet(f"The file name becomes {written}{', for programs that read it.' if kind.path else '.'}")
    return place_actions(prompt, edited, row_of_path, ExportTask, "Export", state, layout, written)


def _purpose_row(chosen: Purpose, layout: Layout) -> Purpose:
    """Draw one button per purpose; return the chosen one."""
    label("For", layout)
    pressed = chosen
    for (purpose, words), width in in_row(tuple(PURPOSES.items()), layout):
        if choice(words, purpose == chosen, layout, (width, 0), PURPOSE_TIPS[purpose]):
            pressed = purpose
    return pressed


def _entries(purpose: Purpose) -> dict[str, tuple[str, str]]:
    """Return the kinds for a purpose, and among those to share the picture, which has another prompt."""
    kinds = {name: (kind.words, _files_of(kind)) for name, kind in saving.kinds_for(purpose).items()}
    return kinds | ({PICTURE: PICTURE_ENTRY} if purpose == "share" else {})


def _files_of(kind: ExportKind) -> str:
    return f"One file: {', '.join(kind.endings)}" if kind.endings else "A folder of files."


def _written_name(kind: ExportKind, prompt: ExportPrompt, scene: Scene) -> str:
    """Return the name of the file that will be written, "" if there is none yet."""
    try:
        return saving.written_path(kind, prompt.path, scene, prompt.options).name
    except InputError:
        return ""


def _say_views(scene: Scene, layout: Layout) -> None:
    label("Views", layout, "Set the number of views with `iibr generate PHOTO --grid`.")
    imgui.text(f"{scene.grid.rows} x {scene.grid.columns} of {scene.width} x {scene.height} pixels")


def _device(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Made for", shown.layout, "The display. For any display, the pictures keep the photo's shape.")
    chosen = shown.options.device or ANY_DISPLAY
    entries = {ANY_DISPLAY: (ANY_DISPLAY, "The photo's shape.")}
    for name, quilt in DEVICES.items():
        size = f"{quilt.size.width} x {quilt.size.height} pixels"
        entries[name] = (name, f"{quilt.columns} x {quilt.rows} views in a picture of {size}.")
    device = choice_row("device", chosen, entries, shown.layout)
    return replace(options, device=None if device == ANY_DISPLAY else device)


def _motion(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Motion", shown.layout, "What moves. The end meets the beginning, so it can loop.")
    entries = {name: (name.capitalize(), MOTION_TIPS[name]) for name in ANIMATIONS}
    motion = choice_row("motion", shown.options.motion, entries, shown.layout)
    return options if motion == shown.options.motion else replace(options, motion=motion)


def _keys(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Camera path", shown.layout, "A text file with a line for each place: s t, s t focus, or s t focus aperture.")
    text, _ = text_field("keys", str(options.keys or ""), "a text file, instead of the motion above")
    return replace(options, keys=Path(text) if text.strip() else None)


def _eyes(options: ExportOptions, shown: _Shown) -> ExportOptions:
    limits = 0.0, float(max(shown.scene.grid.columns - 1, 1))
    tip = "Distance between the eyes, in views. More looks deeper. What is in focus lies on the screen."
    eyes = slider("3D strength", shown.options.eyes, limits, "%.1f", shown.layout, tip)
    return options if eyes is None else replace(options, eyes=eyes)


def _row(options: ExportOptions, shown: _Shown) -> ExportOptions:
    tip = "Row of the picture, counted from the top."
    row = whole_slider("Row", shown.options.row, (0, shown.scene.height - 1), shown.layout, tip)
    return options if row is None else replace(options, row=row)


def _size(options: ExportOptions, shown: _Shown) -> ExportOptions:
    width = size_row(shown.options.size, shown.layout)
    return options if width is None else replace(options, size=size_of_width(shown.kind, shown.aspect, width))


def _frames(options: ExportOptions, shown: _Shown) -> ExportOptions:
    """Draw the number of pictures, or the length of an animation in seconds."""
    if shown.kind.rate:
        label("Length", shown.layout, "Time until it begins again.")
        form = "%.4g s"
        changed, seconds = imgui.input_float("##seconds", shown.options.frames / shown.options.rate, 0, 0, form)
        return replace(options, frames=_frames_in(seconds, shown.options.rate)) if changed else options
    label("Pictures", shown.layout, "Number of pictures from near to far.")
    changed, frames = imgui.input_int("##frames", shown.options.frames, 0, 0)
    return replace(options, frames=min(max(frames, 1), MAX_FRAMES)) if changed else options


def _rate(options: ExportOptions, shown: _Shown) -> ExportOptions:
    """Draw the frame rate. A higher rate keeps the length and raises the number of frames."""
    label("Frame rate", shown.layout, f"Frames per second; {shown.options.frames} frames in all.")
    changed, rate = imgui.input_float("##rate", shown.options.rate, 0, 0, "%.4g fps")
    if not changed:
        return options
    rate = clamp(rate, *RATE_LIMITS) if math.isfinite(rate) else shown.options.rate
    frames = _frames_in(shown.options.frames / shown.options.rate, rate)
    return replace(options, rate=rate, frames=frames if options.frames else 0)


def _frames_in(seconds: float, rate: float) -> int:
    """Return the number of frames, at least two so that something moves."""
    return round(clamp(seconds * rate if math.isfinite(seconds) else 0.0, 2, MAX_FRAMES))


def _layout(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Depth", shown.layout, "Place of the depth beside the picture.")
    layout = choice_row("layout", options.layout, {n: (n.capitalize(), "") for n in DEPTH_LAYOUTS}, shown.layout)
    return options if layout == options.layout else replace(options, layout=layout)


def _bits(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Bits", shown.layout, "Bits per colour channel. 16 keep fine gradients for editing.")
    bits = choice_row("bits", str(options.bits), {str(bits): (f"{bits} bits", "") for bits in STACK_BITS}, shown.layout)
    return options if bits == str(options.bits) else replace(options, bits=int(bits))


def _show(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Display", shown.layout)
    tip = "Needs Looking Glass Bridge, the display's program."
    show = checkbox("show it there when it is written", options.show, shown.layout, tip)
    return options if show is None else replace(options, show=show)


def _budget(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Size limit", shown.layout, "Largest file size. Pictures lose detail or views are left out. 0 for no limit.")
    form = "%.4g MB" if options.budget else "none"
    changed, megabytes = imgui.input_float("##budget", (options.budget or 0) / 1e6, 0, 0, form)
    return replace(options, budget=int(clamp(megabytes, 0, 1000) * 1e6) or None) if changed else options


def _credit(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Metadata", shown.layout)
    tip = "As the photo's file states them. The location is left out."
    credit = checkbox("title, author, copyright", options.credit, shown.layout, tip)
    return options if credit is None else replace(options, credit=credit)


def _stills(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Safari", shown.layout)
    tip = "Stores each view as a picture of its own, which Safari needs. The file is several times as large."
    stills = checkbox("all views in Safari, too", options.stills, shown.layout, tip)
    return options if stills is None else replace(options, stills=stills)


ROWS: dict[str, Row] = {
    "device": _device,
    "motion": _motion,
    "keys": _keys,
    "eyes": _eyes,
    "row": _row,
    "size": _size,
    "frames": _frames,
    "rate": _rate,
    "layout": _layout,
    "bits": _bits,
    "show": _show,
    "budget": _budget,
    "credit": _credit,
    "stills": _stills,
}
"""Rows from top to bottom, by the names in `ExportKind.supports`."""
