"""The panel's section for looking into the light field: EPIs, views, values, overlays and comparisons."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.scenes.scene import Scene
from viewer.model import inspection, preferences
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.commands import OVERLAY_WORDS
from viewer.model.inspection import Comparison, OverlayKind
from viewer.model.preferences import Units
from viewer.ui.widgets import button, checkbox, choices, edit, percent_slider, switch

VIEWS = {
    "epis": (
        "EPIs",
        "Epipolar plane images through the pointer (E): one line of the picture in every view. The steeper a line"
        " slopes, the nearer the surface.",
    ),
    "views": ("Views", "All views. Click a view to go there (G)."),
    "values": ("Values", "Position, distance and colour under the pointer (V)."),
}
UNITS_TIP = "Show focus as disparity in px per view step, and the aperture in view steps."
OVERLAY_TIPS: dict[OverlayKind, str] = {
    "disparity": "Depth as colours (D): the lighter, the nearer.",
    "entropy": "Uncertainty of each pixel: 0 where one pixel of the photo shows it, 1 where none does.",
    "inpainted": "Pixels that the photo does not show, and that were inpainted.",
}
OPACITY_TIP = "Opacity of the colours over the picture."
PHOTO_TIP = "Photo at the left, picture at the right (P). Drag the line between them."
COMPARED_TIP = "Snapshot at the left, picture at the right. Drag the line between them."
SNAPSHOT_TIP = "Remember the picture as it is now, to compare with later (K)."


def inspect_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section."""
    is_on = state.preferences.units == "light field"
    units: Units = "light field" if checkbox("Light-field units", is_on, UNITS_TIP) else "photographic"
    actions = edit(preferences.set_units, state.preferences.units, units)
    return actions + _toggles(state) + _overlays(state, scene) + _comparisons(state)


def _toggles(state: AppState) -> list[Action]:
    shown = state.inspection
    views = {
        "epis": (shown.shows_epis, inspection.show_epis),
        "views": (shown.shows_views, inspection.show_views),
        "values": (shown.shows_values, inspection.show_values),
    }
    pressed = choices(VIEWS, [name for name, (is_on, _) in views.items() if is_on])
    if pressed is None:
        return []
    is_on, verb = views[pressed]
    return [do(verb, not is_on)]


def _overlays(state: AppState, scene: Scene) -> list[Action]:
    imgui.text("Over the picture")
    chosen = state.inspection.overlay
    obstacles = {kind: inspection.obstacle_to_overlay(scene, kind) for kind in OVERLAY_TIPS}
    entries = {kind: (OVERLAY_WORDS[kind].capitalize(), obstacles[kind] or tip) for kind, tip in OVERLAY_TIPS.items()}
    actions = switch(
        inspection.set_overlay, entries, chosen, [kind for kind, obstacle in obstacles.items() if obstacle]
    )
    opacity = percent_slider("Opacity", state.inspection.opacity, OPACITY_TIP, chosen is not None)
    return actions + edit(inspection.set_opacity, state.inspection.opacity, opacity)


def _comparisons(state: AppState) -> list[Action]:
    imgui.text("Compare with")
    chosen, has_snapshot = state.inspection.comparison, state.inspection.snapshot is not None
    entries: dict[Comparison, tuple[str, str]] = {
        "photo": ("Photo", PHOTO_TIP),
        "snapshot": ("Snapshot", COMPARED_TIP if has_snapshot else inspection.NO_SNAPSHOT),
    }
    actions = switch(inspection.compare, entries, chosen, [] if has_snapshot else ["snapshot"])
    return actions + ([do(inspection.take_snapshot)] if button("Take a snapshot", SNAPSHOT_TIP) else [])
