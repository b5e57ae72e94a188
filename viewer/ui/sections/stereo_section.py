"""The panel's section for the stereo picture: display, arrangement, distance of the eyes, and plane of the screen."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.scenes.scene import Scene
from viewer.model import stereo
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.commands import STEREO_WORDS
from viewer.model.stereo import STEREO_MODES, Monitor
from viewer.model.tasks import PlainTask, ask
from viewer.ui.style import palette_of
from viewer.ui.widgets import button, checkbox, colored, combo, depth_slider, edit, label, slider

MONITOR_TIP = "Display that shows the stereo picture, full screen."
WINDOW, WINDOW_TIP = "This window", "The window itself shows the picture, full screen; Tab shows the panel over it."
MODE_TIP = "Arrangement of both eyes' pictures that the display or the glasses expect."
LENTICULAR = "Looking Glass", "a lenticular display that Looking Glass Bridge knows"
EYES_TIP = "How far the pictures of both eyes lie apart at most. More gives more depth; eyes bear 3 % of the width."
SCREEN_TIP = "Depth that lies in the plane of the screen. Nearer things stand before it."
SHOW_TIP = "Show the stereo picture (3). Esc closes it."
FOCUS_TIP = "Put what is in focus into the plane of the screen."
SWAP_TIP = "Give each eye the picture of the other (L)."


def stereo_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section."""
    shown, is_swapped = state.stereo, state.preferences.swaps_eyes
    label("Display", MONITOR_TIP)
    wanted = stereo.monitor_of(state)
    entries = [(monitor.words, WINDOW_TIP if i == 0 else "") for i, monitor in enumerate(state.monitors)]
    picked = combo("Display", wanted.words if wanted else WINDOW, entries, wanted.words if wanted else MONITOR_TIP)
    actions = [] if picked is None else [do(stereo.choose_monitor, state.monitors[picked])]
    label("Arrangement", MODE_TIP)
    entries = [*(STEREO_WORDS[mode] for mode in STEREO_MODES), LENTICULAR]
    shown_words = LENTICULAR[0] if shown.display else STEREO_WORDS[state.preferences.stereo_mode][0]
    picked = combo("Arrangement", shown_words, entries, MODE_TIP)
    if picked is not None:
        is_pair = picked < len(STEREO_MODES)
        actions.append(do(stereo.set_mode, STEREO_MODES[picked]) if is_pair else do(ask, PlainTask("find display")))
    plane = stereo.screen_plane(scene, shown)
    actions += _eyes(state, scene, wanted)
    if state.preferences.units == "light field":
        edited = slider("Screen plane", plane, scene.disparity_range_px, "%.2f px", SCREEN_TIP)
    else:
        edited = depth_slider("Screen plane", plane, scene.disparity_range_px, "%.0f %%", SCREEN_TIP)
    actions += edit(stereo.set_screen, plane, edited)
    if warning := stereo.warning(scene, shown):
        colored(warning, imgui.ImVec4(*palette_of(state.preferences.theme).warning))
    swaps = checkbox("Swap the eyes", is_swapped, SWAP_TIP) != is_swapped
    actions += [do(stereo.swap_eyes)] if swaps else []
    if button("Screen at the focus", FOCUS_TIP, state.optics.focus_disparity != plane):
        actions.append(do(stereo.set_screen, state.optics.focus_disparity))
    imgui.same_line()
    word = "Close" if shown.is_shown else "Show"
    return actions + ([do(stereo.show, not shown.is_shown)] if button(f"{word}###show stereo", SHOW_TIP) else [])


def _eyes(state: AppState, scene: Scene, monitor: Monitor | None) -> list[Action]:
    """Build the slider of the eye distance: the largest parallax, in per cent of the width and, if known, in cm."""
    eyes, a_view = stereo.eye_distance(scene, state.stereo), stereo.parallax_of_a_view(scene, state.stereo)
    width_mm = monitor.width_mm if monitor is not None else 0
    size = f" · {a_view * eyes * width_mm / 10:.1f} cm" if width_mm else ""
    is_in_views = state.preferences.units == "light field"
    unit, form = (1.0, "%.2f views") if is_in_views else (0.01 / a_view, f"%.1f %% of width{size}")
    limits = 0.0, stereo.eye_distance_limit(scene)
    return edit(stereo.set_eyes, eyes, slider("Eye distance", eyes, limits, form, EYES_TIP, unit=unit))
