"""The panel's section for the viewpoint: the pad, buttons beside it, speed of loops, dolly, and a head to follow."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.exports.loops import LOOPS
from iibr_core.scenes.lens_limits import dolly_limit
from iibr_core.scenes.scene import Scene
from viewer.model import lens, tracking, viewpoint
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.tracking import HEAD_RANGE_LIMITS
from viewer.model.viewpoint import SPEED_LIMITS
from viewer.ui.sections.viewpoint_pad import pad
from viewer.ui.widgets import button, checkbox, edit, quiet, slider, tooltip

PAD_TIP = "Drag to move the viewpoint. Dots are views; faint dots are views that are still being made."
RECENTER_TIP = "Return to the photo's viewpoint (double click, or C)."
PAUSE_TIP = "Pause or resume the motion (Space)."
SPEED_TIP = "Speed of a motion."
HEAD_TIP = (
    "The viewpoint follows your head as if the screen were a window (H). opentrack sends its place: see Displays in the"
    " documentation. C makes its present place the middle."
)
HEAD_RANGE_TIP = "Movement of the head from the middle to the outermost views."
DOLLY_TIP = "Step into the picture or back, as far as the views reach."


def view_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section."""
    motion, dolly = state.motion, state.optics.dolly
    actions = pad(state, scene)
    if not motion.is_running:
        tooltip("" if imgui.is_item_active() else PAD_TIP)
    imgui.same_line()
    imgui.begin_group()
    actions += _beside_pad(state)
    imgui.end_group()
    fastest, slowest = (1 / speed for speed in SPEED_LIMITS[::-1])
    seconds = slider("Speed", 1 / motion.speed, (fastest, slowest), "%.1f s a round", SPEED_TIP, is_logarithmic=True)
    actions += [do(viewpoint.set_speed, 1 / seconds)] if seconds != 1 / motion.speed else []
    if farthest := dolly_limit(scene.grid):
        is_in_views = state.preferences.units == "light field"
        unit, form = (1.0, "%+.2f views") if is_in_views else (farthest / 100, "%+.0f %%")
        actions += edit(
            lens.set_dolly, dolly, slider("Dolly", dolly, (-farthest, farthest), form, DOLLY_TIP, unit=unit)
        )
    return actions + _head_rows(state)


def _head_rows(state: AppState) -> list[Action]:
    """Build the switch of the tracker; while it is on, the movement that it takes, and its latency."""
    head, preferences = state.tracking, state.preferences
    actions: list[Action] = []
    if checkbox("Follow the head", head is not None, HEAD_TIP) != (head is not None):
        actions.append(do(tracking.switch, None if head else preferences.tracker))
    if head is not None:
        range_cm = slider("Head movement", preferences.head_range_cm, HEAD_RANGE_LIMITS, "%.0f cm", HEAD_RANGE_TIP)
        actions += edit(tracking.set_head_range, preferences.head_range_cm, range_cm)
        latency = f"{head.latency_ms:.0f} ms from packet to picture"
        quiet(latency if head.is_receiving else f"No poses at {head.address}")
    return actions


def _beside_pad(state: AppState) -> list[Action]:
    """Build the buttons beside the pad, and the viewpoint in one line that never wraps."""
    actions: list[Action] = []
    width, eye = imgui.get_content_region_avail().x, state.optics.eye
    if button("Recenter", RECENTER_TIP, width=width):
        actions.append(do(viewpoint.return_home))
    word = "Resume" if state.motion.is_paused else "Pause"
    if button(f"{word}##motion", PAUSE_TIP, state.motion.kind in LOOPS, width):
        actions.append(do(viewpoint.pause, not state.motion.is_paused))
    s, t = (round(value, 1) + 0.0 for value in (eye.s, eye.t))  # + 0.0 takes the sign of -0.0 away
    imgui.text_disabled(f"{abs(s):.1f} {'←' if s < 0 else '→'}  {abs(t):.1f} {'↑' if t < 0 else '↓'}")
    return actions
