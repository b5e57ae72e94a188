"""Keys -> actions. Reading ImGui's input is one function; judging it another, a pure one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from iibr_core.beyond.optics import CENTRE
from iibr_core.types import ViewOffset
from viewer.app.pointer import is_marking_gloss
from viewer.model.actions import Action, SetState, ShowBefore, ShowPrompt
from viewer.model.commands import BY_NAME, COMMANDS, Chord, Command
from viewer.model.free_camera import LeaveCamera
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_editing import DropStroke, SetBrush
from viewer.model.state.inspection import Compare, SetInspection, SetOverlay
from viewer.model.state.optics_actions import MoveEye, SetGlossBrush

ARROW_STEP_VIEWS = 0.5


@dataclass(frozen=True)
class Keys:
    """The keys of this frame that mean something: arrows as a view offset, Esc, and commands by name; repeats: those of
    them whose keys are held since an earlier frame.
    """

    arrows: ViewOffset = CENTRE
    is_escape: bool = False
    commands: tuple[str, ...] = ()
    repeats: frozenset[str] = frozenset()


def actions_from_keys(keys: Keys, state: AppState) -> list[Action]:
    """What the keys ask for. Esc closes what is open in the window first. What is typed before a prompt has taken the
    keyboard is meant for it.
    """
    actions: list[Action] = []
    if keys.is_escape:
        actions += _escape_actions(state)
    is_typing = state.prompt is not None and not isinstance(state.prompt, str)
    shows_photo = state.shown_generation == state.generation
    commands = [BY_NAME[name] for name in keys.commands]
    commands = [c for c in commands if shows_photo or not (c.when_held == "awaits photo" and c.name in keys.repeats)]
    actions += [command.action(state) for command in commands if not is_typing or command.chords[0].ctrl]
    if any(keys.arrows) and not is_typing:
        eye = state.optics.eye
        step = ARROW_STEP_VIEWS
        actions.append(MoveEye(ViewOffset(eye.t + step * keys.arrows.t, eye.s + step * keys.arrows.s)))
    return actions


def _escape_actions(state: AppState) -> list[Action]:
    """What Esc closes, one at a time: a prompt, a stroke, the sheet of views, a brush, what is compared or laid over
    the picture, the full screen. It never quits.
    """
    if state.prompt is not None:
        return [ShowPrompt(None)]
    if state.free_camera is not None and state.stroke is None:
        return [LeaveCamera()]
    if state.stroke is not None:
        return [DropStroke()]
    if state.inspection.shows_grid:
        return [SetInspection("shows_grid", False)]
    if is_marking_gloss(state):
        return [SetGlossBrush(replace(state.gloss_brush, is_on=False))]
    if state.shows_before:
        return [ShowBefore(False)]
    if state.brush.is_on:
        return [SetBrush(replace(state.brush, is_on=False))]
    if state.inspection.comparison is not None:
        return [Compare(None)]
    if state.inspection.overlay is not None:
        return [SetOverlay(None)]
    return [SetState("is_fullscreen", False)] if state.is_fullscreen else []


def read_keys(used_space: bool, struck: Mapping[str, tuple[bool, bool]]) -> Keys:
    """The keys of this ImGui frame; none while a text field has them. used_space: the mouse was dragged with Space
    held: no more comes of it. That is known only when Space is let go. struck: what was held, see `Window`.
    """
    from imgui_bundle import imgui

    io = imgui.get_io()
    if io.want_text_input:
        return Keys()

    def pressed(key: imgui.Key) -> bool:
        return imgui.is_key_pressed(key)

    held_now = bool(io.key_ctrl or io.key_super), bool(io.key_shift)

    def is_struck(chord: Chord, repeats: bool = True) -> bool:
        holds = struck.get(chord.key.lstrip("_"), held_now) == (chord.ctrl, chord.shift)
        if chord.key == "space":
            return holds and imgui.is_key_released(imgui.Key.space) and not used_space
        return holds and imgui.is_key_pressed(getattr(imgui.Key, chord.key), repeats)

    down = pressed(imgui.Key.down_arrow) - pressed(imgui.Key.up_arrow)
    right = pressed(imgui.Key.right_arrow) - pressed(imgui.Key.left_arrow)

    def strikes(command: Command) -> int:
        """Of its keys in this frame: a long frame holds several of those that are held."""
        chords = [chord for chord in command.chords if is_struck(chord, command.when_held != "once")]
        if not chords or command.when_held != "paced":
            return len(chords[:1])
        key = getattr(imgui.Key, chords[0].key)
        return imgui.get_key_pressed_amount(key, io.key_repeat_delay, io.key_repeat_rate)

    commands = tuple(command.name for command in COMMANDS for _ in range(strikes(command)))
    repeats = frozenset(name for name in commands if not any(is_struck(c, False) for c in BY_NAME[name].chords))
    is_escape = bool(imgui.is_key_pressed(imgui.Key.escape, False))
    if is_escape and imgui.is_popup_open("", imgui.PopupFlags_.any_popup):  # a drop-down, and nothing under it
        imgui.internal.close_popup_to_level(0, True)
        is_escape = False
    return Keys(ViewOffset(float(down), float(right)), is_escape, commands, repeats)


def is_touched() -> bool:
    """Whether any key or mouse button was pressed or the wheel turned in this frame; to move the mouse is none."""
    from imgui_bundle import imgui

    return any(imgui.is_key_pressed(key, False) for key in _named_keys())


@cache
def _named_keys() -> tuple[Any, ...]:
    from imgui_bundle import imgui

    first, end = imgui.Key.named_key_begin, imgui.Key.named_key_end
    return tuple(key for key in imgui.Key if first <= key.value < end)
