"""Keys -> actions: one function reads ImGui's input, another, pure one maps it to actions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from imgui_bundle import imgui

from iibr_core.types import CENTRE, ViewOffset
from viewer.app.pointer import is_marking_gloss
from viewer.model import depth, inspection, lens, messages, selection, stereo, viewpoint, window
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME, COMMANDS, Chord

ARROW_STEP_VIEWS = 0.5
"""Step of an arrow key, in view steps."""


@dataclass(frozen=True)
class Keys:
    """Keys pressed in one frame. arrows: as a view offset. commands: names of the commands that the keys belong to."""

    arrows: ViewOffset = CENTRE
    is_escape: bool = False
    commands: tuple[str, ...] = ()


def actions_from_keys(keys: Keys, state: AppState) -> list[Action]:
    """Return the actions of the keys. While a prompt with a text field is open, letters are no shortcuts."""
    actions = _escape_actions(state) if keys.is_escape else []
    is_typing = state.prompt is not None and not isinstance(state.prompt, str)
    commands = [BY_NAME[name] for name in keys.commands]
    actions += [command.action(state) for command in commands if not is_typing or command.chords[0].ctrl]
    if any(keys.arrows) and not is_typing:
        eye, arrows = state.optics.eye, keys.arrows
        step = ARROW_STEP_VIEWS
        actions.append(do(lens.move_eye, ViewOffset(eye.t + step * arrows.t, eye.s + step * arrows.s)))
    return actions


def _escape_actions(state: AppState) -> list[Action]:
    """Return the action that closes the topmost thing that Esc can close. Esc never quits."""
    can_close = (
        (state.prompt is not None, do(messages.show_prompt, None)),
        (state.stereo.is_shown, do(stereo.show, False)),
        (state.free_camera is not None and state.stroke is None, do(viewpoint.leave_camera)),
        (state.stroke is not None, do(depth.drop_stroke)),
        (state.inspection.shows_views, do(inspection.show_views, False)),
        (is_marking_gloss(state), do(lens.take_gloss_brush, replace(state.gloss_brush, is_on=False))),
        (state.shows_before, do(lens.show_before, False)),
        (state.tilt_handles is not None, do(lens.show_tilt_handles, False)),
        (state.selection is not None, do(selection.deselect)),
        (state.brush.is_on, do(depth.set_brush, replace(state.brush, is_on=False))),
        (state.inspection.comparison is not None, do(inspection.compare, None)),
        (state.inspection.overlay is not None, do(inspection.set_overlay, None)),
        (state.is_fullscreen, do(window.set_fullscreen, False)),
    )
    return [closing for is_open, closing in can_close if is_open][:1]


def read_keys(held_at: Mapping[str, tuple[bool, bool]]) -> Keys:
    """Return the keys pressed in this ImGui frame; none while a text field has the keyboard.

    held_at: see `Window`. After a long frame a modifier may be up again before ImGui handles the key.
    """
    io = imgui.get_io()
    if io.want_text_input:
        return Keys()

    def is_pressed(key: str, repeats: bool = True) -> bool:
        return imgui.is_key_pressed(getattr(imgui.Key, key), repeats)

    held = bool(io.key_ctrl or io.key_super), bool(io.key_shift)

    def is_chord(chord: Chord, repeats: bool) -> bool:
        modifiers = held_at.get(chord.key.lstrip("_"), held)
        return modifiers == (chord.ctrl, chord.shift) and is_pressed(chord.key, repeats)

    commands = tuple(c.name for c in COMMANDS if any(is_chord(chord, c.repeats) for chord in c.chords))
    down = is_pressed("down_arrow") - is_pressed("up_arrow")
    right = is_pressed("right_arrow") - is_pressed("left_arrow")
    is_escape = is_pressed("escape", False)
    if is_escape and imgui.is_popup_open("", imgui.PopupFlags_.any_popup):  # a drop-down, and nothing under it
        imgui.internal.close_popup_to_level(0, True)
        is_escape = False
    return Keys(ViewOffset(float(down), float(right)), is_escape, commands)
