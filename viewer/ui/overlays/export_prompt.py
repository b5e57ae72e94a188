"""The window that asks what to export: the kinds of the registry, and for each the rows that it heeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from imgui_bundle import imgui

from iibr_core.exports import (
    ANIMATIONS,
    EXPORTS,
    MOST_FRAMES,
    RATE_LIMITS,
    AnimationKind,
    ExportKind,
    ExportOptions,
    ExportSettings,
    settle,
    size_of_width,
)
from iibr_core.formats import DEVICES
from iibr_core.scenes import Scene, clamp
from viewer.model.actions import Action, DoTask, ShowPrompt
from viewer.model.layout import Layout
from viewer.model.reducers.exporting import export_path_beside
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt, ExportTask
from viewer.ui.overlays.prompt_rows import (
    choice_row,
    focus_on_appearing,
    path_field,
    prompt_actions,
    prompt_buttons,
    say_problem,
    size_rows,
    text_field,
)
from viewer.ui.widgets import checkbox, gap, label, slider, whole_slider

ANY_DISPLAY = "any"
MOTION_TIPS: dict[AnimationKind, str] = {
    "circle": "The viewpoint goes round.",
    "eight": "The viewpoint goes along a lying eight.",
    "swing": "The viewpoint goes from left to right and back.",
    "focus": "What is sharp goes from near to far and back.",
    "aperture": "The aperture closes and opens again.",
}


@dataclass(frozen=True)
class _Asked:
    """What the rows are about. settings: with what is usual where the user said nothing."""

    kind: ExportKind
    scene: Scene
    settings: ExportSettings
    layout: Layout


def export_prompt(prompt: ExportPrompt, state: AppState, layout: Layout) -> list[Action]:
    """What, where to, and what this kind can be told."""
    assert state.scene is not None
    imgui.text("Export")
    gap(layout, 2)
    label("As", layout)
    kinds = {name: (kind.words, _files_of(kind)) for name, kind in EXPORTS.items()}
    chosen = choice_row("kind", prompt.kind, kinds, layout)
    if chosen != prompt.kind:
        return [ShowPrompt(ExportPrompt(chosen, export_path_beside(state, chosen)))]
    kind, options = EXPORTS[chosen], prompt.options
    asked = _Asked(kind, state.scene, settle(kind, options, state.scene, state.optics), layout)
    for name, row in ROWS.items():
        if name in kind.heeds:
            options = row(options, asked)
    focus_on_appearing()
    label("File" if kind.endings else "Folder", layout)
    path, entered = path_field(prompt.path, layout)
    edited = replace(prompt, path=path, options=options)
    if edited != prompt:
        edited = replace(edited, already_there=False, problem="")
    say_problem(prompt.problem or ("There is one of this name already." if prompt.already_there else ""), state)
    pressed, closed = prompt_buttons("Replace" if prompt.already_there else "Export", layout)
    if pressed or entered:
        return [DoTask(ExportTask(chosen, path, options, prompt.already_there))]
    return prompt_actions(closed, edited, prompt)


def _files_of(kind: ExportKind) -> str:
    return f"One file: {', '.join(kind.endings)}" if kind.endings else "A folder of files."


def _shape_of(device: str) -> str:
    quilt = DEVICES[device]
    return f"{quilt.columns} x {quilt.rows} views in a picture of {quilt.size.width} x {quilt.size.height}."


def _device(options: ExportOptions, asked: _Asked) -> ExportOptions:
    label("Made for", asked.layout, "A display; without one, the photo's own shape.")
    shown = asked.settings.device or ANY_DISPLAY
    entries = {ANY_DISPLAY: (ANY_DISPLAY, "The photo's own shape.")} | {
        name: (name, _shape_of(name)) for name in DEVICES
    }
    device = choice_row("device", shown, entries, asked.layout)
    return replace(options, device=None if device == ANY_DISPLAY else device)


def _motion(options: ExportOptions, asked: _Asked) -> ExportOptions:
    label("Motion", asked.layout, "What moves; the end leads to the beginning.")
    motion = choice_row("motion", asked.settings.motion, {n: (n, MOTION_TIPS[n]) for n in ANIMATIONS}, asked.layout)
    return options if motion == asked.settings.motion else replace(options, motion=motion)


def _keys(options: ExportOptions, asked: _Asked) -> ExportOptions:
    label("Own path", asked.layout, "A text file with a line a key: s t, s t focus, or s t focus aperture.")
    text, _ = text_field("keys", str(asked.settings.keys or ""), "a file of keys, instead of the motion")
    return replace(options, keys=Path(text) if text.strip() else None)


def _eyes(options: ExportOptions, asked: _Asked) -> ExportOptions:
    limits = 0.0, float(max(asked.scene.grid.columns - 1, 1))
    tip = "View steps from eye to eye. What is in focus lies in the screen."
    eyes = slider("Eyes", asked.settings.eyes, limits, "%.1f views apart", asked.layout, tip)
    return options if eyes is None else replace(options, eyes=eyes)


def _row(options: ExportOptions, asked: _Asked) -> ExportOptions:
    limits = 0, asked.scene.height - 1
    row = whole_slider("Row", asked.settings.row, limits, asked.layout, "Of the picture, from its top.")
    return options if row is None else replace(options, row=row)


def _size(options: ExportOptions, asked: _Asked) -> ExportOptions:
    width = size_rows(asked.settings.size, asked.layout)
    return options if width is None else replace(options, size=size_of_width(asked.kind, asked.settings.aspect, width))


def _frames(options: ExportOptions, asked: _Asked) -> ExportOptions:
    label("Pictures", asked.layout, "How many.")
    changed, frames = imgui.input_int("##frames", asked.settings.frames, 0, 0)
    return replace(options, frames=min(max(frames, 1), MOST_FRAMES)) if changed else options


def _rate(options: ExportOptions, asked: _Asked) -> ExportOptions:
    settings = asked.settings
    label("Rate", asked.layout, f"Pictures a second: it lasts {settings.frames / settings.rate:.3g} seconds.")
    changed, rate = imgui.input_float("##rate", settings.rate, 0, 0, "%.4g a second")
    return replace(options, rate=clamp(rate, *RATE_LIMITS)) if changed else options


def _show(options: ExportOptions, asked: _Asked) -> ExportOptions:
    label("Display", asked.layout)
    tip = "By Looking Glass Bridge, which must run."
    show = checkbox("Show it there when it is written", options.show, asked.layout, tip)
    return options if show is None else replace(options, show=show)


ROWS: dict[str, Callable[[ExportOptions, _Asked], ExportOptions]] = {
    "device": _device,
    "motion": _motion,
    "keys": _keys,
    "eyes": _eyes,
    "row": _row,
    "size": _size,
    "frames": _frames,
    "rate": _rate,
    "show": _show,
}
"""In their order from above, by the names that `ExportKind.heeds` has."""
