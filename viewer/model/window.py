"""Verbs about the window and its pointer: full screen, the panel, and the report of the last drawing; its layout."""

from __future__ import annotations

from dataclasses import dataclass, replace

from iibr_core.scenes.screen_size import ScreenSize
from viewer.model import depth
from viewer.model.action import Setter, setter
from viewer.model.app_state import AppState
from viewer.model.inspection import beside_of
from viewer.model.layout import Layout, layout_of


@dataclass(frozen=True)
class DrawReport:
    """Report of the last drawing: samples drawn so far, samples of the converged picture, and time in milliseconds.

    is_draft: whether the picture is coarser than the screen.
    """

    samples: int = 0
    samples_converged: int = 0
    draw_ms: float = 0.0
    is_draft: bool = False


def set_fullscreen(state: AppState, is_fullscreen: bool) -> AppState:
    """Fill the screen with the picture, or stop that; Tab shows the panel."""
    if is_fullscreen == state.is_fullscreen:
        return state
    hides_panel = None if is_fullscreen else state.hid_panel
    return replace(state, is_fullscreen=is_fullscreen, hides_panel=hides_panel, hid_panel=state.hides_panel)


def toggle_panel(state: AppState) -> AppState:
    """Show or hide the panel; a choice that agrees with the window is forgotten."""
    usual, hides = replace(state, hides_panel=None), not state.is_panel_hidden
    return usual if usual.is_panel_hidden == hides else replace(state, hides_panel=hides)


set_narrow: Setter[bool] = setter("is_narrow")
"""Note whether the window is too narrow for a panel beside the picture."""
set_report: Setter[DrawReport | None] = setter("report")
"""Note how the last picture was drawn."""


def end_gesture(state: AppState) -> AppState:
    """Release handles, divider and stroke, as the pointer does: the next step is another edit, for undo."""
    state = depth.end_stroke(state)
    if state.inspection.divider_taken:
        state = replace(state, inspection=replace(state.inspection, divider_taken=False))
    if state.tilt_handles is not None and state.tilt_handles.taken is not None:
        state = replace(state, tilt_handles=replace(state.tilt_handles, taken=None))
    return replace(state, history=replace(state.history, gesture="")) if state.history.gesture else state


def layout_for(state: AppState, size: ScreenSize, pixel_ratio: float, ui_scale: float) -> Layout:
    """Return the layout of a window of this size that shows the state. See `layout_of`."""
    scene = state.scene
    return layout_of(
        size,
        scene.size if scene else None,
        pixel_ratio,
        ui_scale,
        beside_of(state),
        has_panel=not state.is_panel_hidden,
        zoom=state.zoom,
        own_width=scene.own_size.width if scene and scene.own_size else None,
    )
