"""The prompt for an export: its purpose, the kinds of the table for this purpose, and the options of the kind."""

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
from viewer.model.action import Action, ask, do
from viewer.model.layout import Layout
from viewer.model.saving import as_other_kind, first_kind, kinds_for, written_path
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt, ExportTask
from viewer.model.state.preferences import is_seen_open
from viewer.model.state.tasks import ChoosePlaceTask
from viewer.ui.overlays.prompt_rows import (
    choice_row,
    path_row,
    prompt_actions,
    prompt_buttons,
    say_problem,
    size_rows,
    text_field,
)
from viewer.ui.widgets import checkbox, choice, gap, in_row, label, quiet, slider, whole_slider

ADVANCED_ROWS = ("keys",)
"""Rows that are shown once the panel's advanced section was opened."""
ANY_DISPLAY = "any"
ALREADY_THERE = "There is one of this name already. Replace it, or choose another name."
NAME_REASON = ": programs read its contents from the name."
PICTURE, PICTURE_ENTRY = "picture", ("Picture: PNG, JPEG, …", "One picture, as it looks now, as large as you like.")
PURPOSE_TIPS: dict[Purpose, str] = {
    "share": "What everybody can look at, without this program.",
    "display": "For light-field displays, headsets, 3D televisions and glasses.",
    "software": "Views, cameras, depth and splats, to work on with other programs.",
}
MOTION_TIPS: dict[AnimationKind, str] = {
    "circle": "The viewpoint goes round.",
    "eight": "The viewpoint goes along a lying eight.",
    "swing": "The viewpoint goes from left to right and back.",
    "focus": "What is sharp goes from near to far and back.",
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


def export_prompt(prompt: ExportPrompt, state: AppState, layout: Layout) -> list[Action]:
    """Draw the prompt; return the actions of the user."""
    assert state.scene is not None
    imgui.text("Share or export")
    gap(layout, 2)
    purpose = _purpose_row(EXPORTS[prompt.kind].purpose, layout)
    label("As", layout)
    chosen = prompt.kind if purpose == EXPORTS[prompt.kind].purpose else first_kind(purpose)
    chosen = choice_row("kind", chosen, _entries(purpose), layout)
    if chosen == PICTURE:
        return [do(saving.ask_to_save)]
    if chosen != prompt.kind:
        return [do(messages.show_prompt, as_other_kind(state, prompt, chosen))]
    kind, options, sections = EXPORTS[chosen], prompt.options, state.preferences.open_sections
    filled = with_defaults(kind, options, state.scene, state.optics)
    aspect = picture_aspect(kind, filled.eyes, state.scene, state.optics)
    shown = _Shown(kind, state.scene, filled, aspect, layout)
    for name, row in ROWS.items():
        if name in kind.supports and (name not in ADVANCED_ROWS or is_seen_open("advanced", sections)):
            options = row(options, shown)
    path, entered, browses = path_row("File" if kind.endings else "Folder", prompt.path, layout)
    edited = replace(prompt, path=path, options=options)
    if edited != prompt:
        edited = replace(edited, already_there=False, problem="")
    _say_written_name(kind, edited, state.scene)
    say_problem(prompt.problem or (ALREADY_THERE if prompt.already_there else ""), state)
    pressed, closed = prompt_buttons("Replace" if prompt.already_there else _word_of(kind), layout)
    if browses:
        return [do(messages.show_prompt, edited), do(ask, ChoosePlaceTask(edited))]
    if pressed or entered:
        return [do(ask, ExportTask(chosen, path, options, prompt.already_there))]
    return prompt_actions(closed, edited, prompt)


def _word_of(kind: ExportKind) -> str:
    return "Make it" if kind.purpose == "share" else "Export"


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
    kinds = {name: (kind.words, _files_of(kind)) for name, kind in kinds_for(purpose).items()}
    return kinds | ({PICTURE: PICTURE_ENTRY} if purpose == "share" else {})


def _say_written_name(kind: ExportKind, prompt: ExportPrompt, scene: Scene) -> None:
    """Show the name of the file if it differs from the typed name."""
    try:
        name = written_path(kind, prompt.path, scene, prompt.options).name
    except InputError:
        return
    if name != Path(prompt.path.strip()).name:
        quiet(f"It is written as {name}{NAME_REASON if kind.path else '.'}")


def _files_of(kind: ExportKind) -> str:
    return f"One file: {', '.join(kind.endings)}" if kind.endings else "A folder of files."


def _shape_of(device: str) -> str:
    quilt = DEVICES[device]
    return f"{quilt.columns} x {quilt.rows} views in a picture of {quilt.size.width} x {quilt.size.height}."


def _device(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Made for", shown.layout, "Which display it is for. For any, the pictures keep the photo's shape.")
    chosen = shown.options.device or ANY_DISPLAY
    entries = {ANY_DISPLAY: (ANY_DISPLAY, "The photo's own shape.")} | {
        name: (name, _shape_of(name)) for name in DEVICES
    }
    device = choice_row("device", chosen, entries, shown.layout)
    return replace(options, device=None if device == ANY_DISPLAY else device)


def _motion(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Motion", shown.layout, "What moves. The end joins the beginning, so that it can run over and over.")
    motion = choice_row(
        "motion", shown.options.motion, {n: (n.capitalize(), MOTION_TIPS[n]) for n in ANIMATIONS}, shown.layout
    )
    return options if motion == shown.options.motion else replace(options, motion=motion)


def _keys(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Own path", shown.layout, "A text file, a line for each place: s t, s t focus, or s t focus aperture.")
    text, _ = text_field("keys", str(shown.options.keys or ""), "a text file, instead of the motion above")
    return replace(options, keys=Path(text) if text.strip() else None)


def _eyes(options: ExportOptions, shown: _Shown) -> ExportOptions:
    limits = 0.0, float(max(shown.scene.grid.columns - 1, 1))
    tip = "How far apart the eyes are: more looks deeper. What is in focus seems to lie on the screen."
    eyes = slider("Eyes", shown.options.eyes, limits, "%.1f views apart", shown.layout, tip)
    return options if eyes is None else replace(options, eyes=eyes)


def _row(options: ExportOptions, shown: _Shown) -> ExportOptions:
    limits = 0, shown.scene.height - 1
    row = whole_slider(
        "Row", shown.options.row, limits, shown.layout, "Which row of the picture, counted from its top."
    )
    return options if row is None else replace(options, row=row)


def _size(options: ExportOptions, shown: _Shown) -> ExportOptions:
    width = size_rows(shown.options.size, shown.layout)
    return options if width is None else replace(options, size=size_of_width(shown.kind, shown.aspect, width))


def _frames(options: ExportOptions, shown: _Shown) -> ExportOptions:
    """Draw the number of pictures, or the length of an animation in seconds."""
    if shown.kind.rate:
        return _seconds(options, shown)
    label("Pictures", shown.layout, "How many, from one end to the other.")
    changed, frames = imgui.input_int("##frames", shown.options.frames, 0, 0)
    return replace(options, frames=min(max(frames, 1), MAX_FRAMES)) if changed else options


def _seconds(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Length", shown.layout, "How long it lasts, until it begins again.")
    changed, seconds = imgui.input_float("##seconds", shown.options.frames / shown.options.rate, 0, 0, "%.4g seconds")
    return replace(options, frames=_frames_in(seconds, shown.options.rate)) if changed else options


def _rate(options: ExportOptions, shown: _Shown) -> ExportOptions:
    """Draw the frame rate. A higher rate keeps the length and raises the number of frames."""
    label("Smoothness", shown.layout, f"Pictures a second; {shown.options.frames} of them are made.")
    changed, rate = imgui.input_float("##rate", shown.options.rate, 0, 0, "%.4g pictures a second")
    if not changed:
        return options
    rate = clamp(rate, *RATE_LIMITS) if math.isfinite(rate) else shown.options.rate
    frames = _frames_in(shown.options.frames / shown.options.rate, rate)
    return replace(options, rate=rate, frames=frames if options.frames else 0)


def _frames_in(seconds: float, rate: float) -> int:
    """Return the number of frames, at least two so that something moves."""
    return round(clamp(seconds * rate if math.isfinite(seconds) else 0.0, 2, MAX_FRAMES))


def _layout(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Depth", shown.layout, "Where the depth lies beside the picture.")
    layout = choice_row("layout", options.layout, {n: (n.capitalize(), "") for n in DEPTH_LAYOUTS}, shown.layout)
    return options if layout == options.layout else replace(options, layout=layout)


def _bits(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Bits", shown.layout, "Bits a channel: 16 keep fine gradients for editing.")
    bits = choice_row("bits", str(options.bits), {str(bits): (f"{bits} bits", "") for bits in STACK_BITS}, shown.layout)
    return options if bits == str(options.bits) else replace(options, bits=int(bits))


def _show(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Display", shown.layout)
    tip = "Looking Glass Bridge, the display's own program, must be running."
    show = checkbox("Show it there when it is written", options.show, shown.layout, tip)
    return options if show is None else replace(options, show=show)


def _budget(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Size limit", shown.layout, "To keep it, pictures lose detail, or there are fewer. 0: none.")
    form = "%.4g MB" if options.budget else "none"
    changed, megabytes = imgui.input_float("##budget", (options.budget or 0) / 1e6, 0, 0, form)
    return replace(options, budget=int(clamp(megabytes, 0, 1000) * 1e6) or None) if changed else options


def _credit(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Names", shown.layout)
    tip = "As the photo's file has them; never where it was taken."
    credit = checkbox("Title, author and rights", options.credit, shown.layout, tip)
    return options if credit is None else replace(options, credit=credit)


def _stills(options: ExportOptions, shown: _Shown) -> ExportOptions:
    label("Safari", shown.layout)
    tip = "Stores each view as a separate picture, which Safari needs. The file is several times as large."
    stills = checkbox("All views in Safari, too", options.stills, shown.layout, tip)
    return options if stills is None else replace(options, stills=stills)


ROWS: dict[str, Callable[[ExportOptions, _Shown], ExportOptions]] = {
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
