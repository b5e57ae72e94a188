"""The panel's section for the viewpoint: the pad, loops beside it, dolly below."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.exports import LOOPS
from iibr_core.scenes import Scene, dolly_limit
from viewer.model.actions import Action
from viewer.model.commands import LOOP_WORDS
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.motion import PauseMotion, ReturnHome, SetLoop, SetSpeed
from viewer.model.state.optics import SetOptics
from viewer.model.window_limits import SPEED_LIMITS
from viewer.ui.sections.viewpoint_pad import PAD_SIDE, pad
from viewer.ui.widgets import button, choice, slider, tooltip

PAD_TIP = "Drag to move the viewpoint. Dots are views, faint ones still to be made; beyond the light area is a guess."


def view_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section."""
    actions = pad(state, scene, layout)
    if not state.motion.is_running:
        tooltip("" if imgui.is_item_active() else PAD_TIP, layout)
    imgui.same_line()
    imgui.begin_group()
    actions += _loops(state, layout)
    _place(state)
    imgui.end_group()
    actions += _speed(state, layout)
    if farthest := dolly_limit(scene.grid):
        tip = "Step into the picture or back out of it, as far as the views allow."
        dolly = slider("Dolly", state.optics.dolly, (-farthest, farthest), "%+.2f views", layout, tip)
        actions += [] if dolly is None else [SetOptics("dolly", dolly)]
    return actions


def _loops(state: AppState, layout: Layout) -> list[Action]:
    """One button a loop; the one that runs is lit, and pressing it again stops it."""
    actions: list[Action] = []
    width = imgui.get_content_region_avail().x
    for kind in LOOPS:
        is_chosen = state.motion.kind == kind
        if choice(LOOP_WORDS[kind], is_chosen, layout, (width, 0)):
            actions.append(SetLoop(None if is_chosen else kind))
    if button("To the middle", layout, "Glide back to the photo's own viewpoint (double click)", width=width):
        actions.append(ReturnHome())
    return actions


def _place(state: AppState) -> None:
    """Where the viewpoint is, in one line that never wraps."""
    eye = state.optics.eye
    s, t = (round(value, 1) + 0.0 for value in (eye.s, eye.t))  # + 0.0 takes the sign of -0.0 away
    imgui.text_disabled(f"{abs(s):.1f} {'←' if s < 0 else '→'}  {abs(t):.1f} {'↑' if t < 0 else '↓'}")


def _speed(state: AppState, layout: Layout) -> list[Action]:
    """How fast a loop goes; it can be set before, and held while one runs."""
    actions: list[Action] = []
    speed = slider("Speed", state.motion.speed, SPEED_LIMITS, "%.2f turns/s", layout, is_logarithmic=True)
    if speed is not None:
        actions.append(SetSpeed(speed))
    word = "Go on" if state.motion.is_paused else "Pause"
    if button(word, layout, "Space", state.motion.kind in LOOPS, PAD_SIDE * layout.ui_scale):
        actions.append(PauseMotion(not state.motion.is_paused))
    return actions
