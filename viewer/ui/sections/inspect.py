"""The panel's section for looking into the light field: EPIs, views, values, overlays and comparisons."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.scenes.scene import Scene
from viewer.model import inspection, preferences
from viewer.model.action import Action, do
from viewer.model.commands import OVERLAY_WORDS
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.inspection import COMPARISONS, OVERLAYS, Comparison, OverlayKind
from viewer.ui.widgets import button, checkbox, choice, in_row, percent_slider

EPI_TIP = (
    "Epipolar plane images through the pointer (E): one line of the picture in every view. The steeper a line slopes,"
    " the nearer the surface."
)
VIEWS_TIP = "All views. Click a view to go there (G)."
VALUES_TIP = "Position, distance and colour under the pointer (V)."
UNITS_TIP = "Show focus as disparity in px per view step, and the aperture in view steps."
OVERLAY_TIPS: dict[OverlayKind, str] = {
    "disparity": "Depth as colours (D): the lighter, the nearer.",
    "entropy": "Uncertainty of each pixel: 0 where one pixel of the photo shows it, 1 where none does.",
    "inpainted": "Pixels that the photo does not show, and that were inpainted.",
}
OPACITY_TIP = "Opacity of the colours over the picture."
COMPARISON_WORDS: dict[Comparison, str] = {"photo": "Photo", "snapshot": "Snapshot"}
COMPARISON_TIPS: dict[Comparison, str] = {
    "photo": "Photo at the left, picture at the right (P). Drag the line between them.",
    "snapshot": "Snapshot at the left, picture at the right. Drag the line between them.",
}
SNAPSHOT_TIP = "Remember the picture as it is now, to compare with later (K)."


def inspect_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section."""
    actions = _units(state, layout) + _toggles(state, layout)
    return actions + _overlays(state, scene, layout) + _comparisons(state, layout)


def _units(state: AppState, layout: Layout) -> list[Action]:
    is_on = state.preferences.units == "light field"
    is_chosen = checkbox("Light-field units", is_on, layout, UNITS_TIP)
    return [] if is_chosen is None else [do(preferences.set_units, "light field" if is_chosen else "photographic")]


def _toggles(state: AppState, layout: Layout) -> list[Action]:
    shown = state.inspection
    row = (
        ("EPIs", shown.shows_epis, EPI_TIP, inspection.show_epis),
        ("Views", shown.shows_views, VIEWS_TIP, inspection.show_views),
        ("Values", shown.shows_values, VALUES_TIP, inspection.show_values),
    )
    actions: list[Action] = []
    for (word, is_on, tip, verb), width in in_row(row, layout):
        if choice(word, is_on, layout, (width, 0), tip):
            actions.append(do(verb, not is_on))
    return actions


def _overlays(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    imgui.text("Over the picture")
    chosen = state.inspection.overlay
    actions: list[Action] = []
    for kind, width in in_row(OVERLAYS, layout):
        obstacle = inspection.obstacle_to_overlay(scene, kind)
        imgui.begin_disabled(bool(obstacle))
        if choice(OVERLAY_WORDS[kind].capitalize(), chosen == kind, layout, (width, 0), obstacle or OVERLAY_TIPS[kind]):
            actions.append(do(inspection.set_overlay, None if chosen == kind else kind))
        imgui.end_disabled()
    opacity = percent_slider("Opacity", state.inspection.opacity, layout, OPACITY_TIP, chosen is not None)
    return actions if opacity is None else [*actions, do(inspection.set_opacity, opacity)]


def _comparisons(state: AppState, layout: Layout) -> list[Action]:
    imgui.text("Compare with")
    chosen = state.inspection.comparison
    actions: list[Action] = []
    for kind, width in in_row(COMPARISONS, layout):
        is_missing = kind == "snapshot" and state.inspection.snapshot is None
        imgui.begin_disabled(is_missing)
        tip = inspection.NO_SNAPSHOT if is_missing else COMPARISON_TIPS[kind]
        if choice(COMPARISON_WORDS[kind], chosen == kind, layout, (width, 0), tip):
            actions.append(do(inspection.compare, None if chosen == kind else kind))
        imgui.end_disabled()
    if button("Take a snapshot", layout, SNAPSHOT_TIP):
        actions.append(do(inspection.take_snapshot))
    return actions
