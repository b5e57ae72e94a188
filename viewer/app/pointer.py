"""The mouse -> actions, by pure functions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from iibr_core.scenes.lens_limits import focus_limits
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewOffset
from viewer.model import depth, gesture, inspection, lens, selection, viewpoint
from viewer.model.action import Action, do
from viewer.model.focal_plane import handle_points, place_of
from viewer.model.inspection import view_at
from viewer.model.layout import Layout, pixel_at
from viewer.model.state.app_state import AppState, Hover
from viewer.model.state.depth import DepthSample

DRAG_THRESHOLD = 4.0
"""A press that moved farther than this (window units) is a drag, not a click."""

DRAG_ACROSS_GRID = 0.6
"""The share of the picture's width that a drag takes from one side of the grid to the other, at least."""

FOCUS_STEPS = 40
"""Notches of the wheel from the nearest focus to the farthest."""

BRUSH_NOTCH = 1.15
"""A notch of the wheel makes the brush so many times as large."""

HANDLE_REACH = 14.0
"""A press this close to a tilt handle (window units at usual size) takes it."""

DIVIDER_REACH = 8.0
"""A press this close to the divider takes it."""


@dataclass(frozen=True)
class Pointer:
    """The mouse as seen in one frame, in window units; steps are how far it moved since the frame before.

    drag_distance: the farthest from where it was pressed, the frame of its release included. becomes_drag: whether it
    has been no drag before this frame. pulls: the middle button is down: the drag moves the picture. holds_ctrl:
    Ctrl is down, or was at the frame's beginning. holds_panel: whether the press that is held was on a panel.
    panel_press: place and time (seconds) of the last press on a panel.
    """

    x: float = 0.0
    y: float = 0.0
    step_x: float = 0.0
    step_y: float = 0.0
    drag_distance: float = 0.0
    becomes_drag: bool = False
    pressed_x: float = 0.0
    pressed_y: float = 0.0
    is_down: bool = False
    is_pressed: bool = False
    is_released: bool = False
    clicks: int = 0
    wheel: float = 0.0
    is_over_panel: bool = False
    holds_panel: bool = False
    panel_press: tuple[float, float, float] = (0.0, 0.0, -math.inf)
    holds_ctrl: bool = False
    pulls: bool = False


NO_POINTER = Pointer()


Pick = Callable[[float, float], float | None]
"""Disparity at a pixel of the picture, or None."""


def actions_from_pointer(pointer: Pointer, layout: Layout, state: AppState, pick: Pick) -> list[Action]:
    """What the mouse asks for. Drags and clicks count where they began in the picture; the panel's never arrive."""
    scene, picture = state.scene, layout.picture
    if scene is None or picture is None or pointer.is_over_panel:
        return []
    frame = layout.frame or picture
    if state.inspection.shows_views:
        return _on_sheet(pointer, layout, scene, frame)
    if pointer.pulls or _zooms(pointer, layout, frame):
        return _zoom_actions(pointer, layout, frame)
    if is_marking_gloss(state):
        return _gloss_actions(pointer, layout, state, scene, picture, pick)
    if is_brushing(state):
        return _paint_actions(pointer, layout, state, scene, picture, pick)
    if pointer.wheel and frame.contains(pointer.x, pointer.y):
        low, high = focus_limits(scene)
        return [do(lens.set_focus, state.optics.focus_disparity + pointer.wheel * (high - low) / FOCUS_STEPS)]
    if not frame.contains(pointer.pressed_x, pointer.pressed_y):
        return []
    if (pointer.is_down or pointer.is_released) and pointer.drag_distance > DRAG_THRESHOLD:
        return _drag(pointer, layout, state, scene, picture, pick)
    if pointer.is_released and pointer.drag_distance <= DRAG_THRESHOLD:
        if _grabs_divider(pointer, layout, state, frame):
            return []
        if pointer.clicks > 1:
            return [do(viewpoint.return_home, takes_back_click=True)]
        at = pixel_at(picture, scene.size, pointer.x, pointer.y)
        picked = pick(*at)
        return [] if picked is None else [do(lens.focus_on, place_of(*at, scene), picked)]
    return []


def gesture_start(pointer: Pointer, state: AppState) -> list[Action]:
    """What a press ends: more of the same kind is another edit from here on. Goes before the frame's edits."""
    return [do(gesture.end_gesture)] if pointer.is_pressed and state.history.gesture else []


def gesture_end(pointer: Pointer) -> list[Action]:
    """What letting go ends. Goes after the frame's edits."""
    return [do(gesture.end_gesture)] if pointer.is_released else []


def actions_from_hover(pointer: Pointer, layout: Layout, state: AppState, pick: Pick) -> list[Action]:
    """Tell where the pointer is in the picture, if that is news. While it drags it points at nothing."""
    scene, picture = state.scene, layout.picture
    hover, paints = None, is_brushing(state) or is_marking_gloss(state)
    is_pointing = (
        not pointer.is_over_panel
        and not state.inspection.shows_views
        and not (pointer.pulls or _is_on_minimap(layout, pointer.x, pointer.y))
        and (paints or not (pointer.is_down and pointer.drag_distance > DRAG_THRESHOLD))
    )
    frame = layout.frame
    if scene is not None and picture and frame and is_pointing and frame.contains(pointer.x, pointer.y):
        x_px, y_px = pixel_at(picture, scene.size, pointer.x, pointer.y)
        hover = Hover(x_px, y_px, pick(x_px, y_px))
    return [do(inspection.set_hover, hover)] if hover != state.hover else []


def is_brushing(state: AppState) -> bool:
    """Whether dragging over the picture paints."""
    scene = state.scene
    return state.brush.is_on and scene is not None and scene.plan is not None and not scene.is_sketch


def is_marking_gloss(state: AppState) -> bool:
    """Return whether dragging over the picture marks the glossy surface."""
    return state.gloss_brush.is_on and state.optics.gloss is not None and state.scene is not None


def _zooms(pointer: Pointer, layout: Layout, frame: Rect) -> bool:
    """Whether the wheel zooms, or the press was on the small picture."""
    if pointer.wheel and pointer.holds_ctrl:
        return frame.contains(pointer.x, pointer.y)
    is_held = pointer.is_down or pointer.is_released
    return is_held and _is_on_minimap(layout, pointer.pressed_x, pointer.pressed_y)


def _is_on_minimap(layout: Layout, x: float, y: float) -> bool:
    return layout.minimap is not None and layout.minimap.contains(x, y)


def _zoom_actions(pointer: Pointer, layout: Layout, frame: Rect) -> list[Action]:
    """Larger or smaller about the pointer; else the picture follows the hand, or shows what is under it on the small
    picture.
    """
    if pointer.wheel and pointer.holds_ctrl and frame.contains(pointer.x, pointer.y):
        return [do(viewpoint.set_zoom, layout.zoomed(pointer.wheel, pointer.x, pointer.y))]
    if not pointer.pulls:
        return [do(viewpoint.set_zoom, layout.shown_on_minimap(pointer.x, pointer.y))]
    if not layout.is_zoomed or not (pointer.step_x or pointer.step_y):
        return []
    return [do(viewpoint.set_zoom, layout.pulled(pointer.step_x, pointer.step_y))]


def _paint_actions(
    pointer: Pointer, layout: Layout, state: AppState, scene: Scene, picture: Rect, pick: Pick
) -> list[Action]:
    """Return the actions of a tool: it paints on the surface under the pointer, picks its depth (Ctrl), or selects it.
    The wheel sets the size of the brush, or the tolerance of the selection.
    """
    frame = layout.frame or picture
    brush = state.brush
    if pointer.wheel and frame.contains(pointer.x, pointer.y):
        factor = BRUSH_NOTCH**pointer.wheel
        if brush.tool == "select":
            return [do(depth.set_brush, replace(brush, tolerance=brush.tolerance * factor))]
        return [do(depth.set_brush, replace(brush, radius=brush.radius * factor))]
    begins = pointer.is_pressed and frame.contains(pointer.pressed_x, pointer.pressed_y)
    if not pointer.is_down or not (begins or state.stroke is not None):
        return []
    place, disparity = _place_in_photo(pointer, state, scene, picture, pick)
    if brush.tool == "select":
        return [do(selection.select, place)] if begins else []
    if state.stroke is None and pointer.holds_ctrl:
        return [do(depth.pick, DepthSample(place, disparity))]
    return [do(depth.paint, place)]


def _place_in_photo(
    pointer: Pointer, state: AppState, scene: Scene, picture: Rect, pick: Pick
) -> tuple[tuple[float, float], float]:
    """Return where the photo shows the surface under the pointer, in shares of its size, and its disparity."""
    x_px, y_px = pixel_at(picture, scene.size, pointer.x, pointer.y)
    disparity, eye = pick(x_px, y_px) or 0.0, state.optics.eye
    x_px, y_px = x_px + disparity * eye.s, y_px + disparity * eye.t
    return ((x_px + 0.5) / scene.width, (y_px + 0.5) / scene.height), disparity


def _gloss_actions(
    pointer: Pointer, layout: Layout, state: AppState, scene: Scene, picture: Rect, pick: Pick
) -> list[Action]:
    """Mark the surface under the pointer; the wheel makes the brush larger."""
    frame, brush = layout.frame or picture, state.gloss_brush
    if pointer.wheel and frame.contains(pointer.x, pointer.y):
        return [do(lens.take_gloss_brush, replace(brush, radius=brush.radius * BRUSH_NOTCH**pointer.wheel))]
    if not pointer.is_down or not frame.contains(pointer.pressed_x, pointer.pressed_y):
        return []
    place, _ = _place_in_photo(pointer, state, scene, picture, pick)
    return [do(lens.paint_gloss, place, brush, begins=pointer.is_pressed)]


def _drag(pointer: Pointer, layout: Layout, state: AppState, scene: Scene, picture: Rect, pick: Pick) -> list[Action]:
    """The divider or a tilt handle where one was taken, else the viewpoint."""
    frame = layout.frame or picture
    if _grabs_divider(pointer, layout, state, frame):
        return [do(inspection.move_divider, (pointer.x - frame.x) / frame.width)]
    index = _grabbed_handle(pointer, layout, state, picture)
    if index is not None:
        at = pixel_at(picture, scene.size, pointer.x, pointer.y)
        return [do(lens.move_tilt_handle, index, place_of(*at, scene), pick(*at))]
    return _eye_drag(pointer, layout, scene, state.optics.eye)


def _grabs_divider(pointer: Pointer, layout: Layout, state: AppState, frame: Rect) -> bool:
    """Whether the press was close to the divider, or it is dragged already."""
    shown = state.inspection
    if shown.comparison is None:
        return False
    x = frame.x + shown.divider * frame.width
    return shown.divider_taken or abs(pointer.pressed_x - x) <= DIVIDER_REACH * layout.ui_scale


def _on_sheet(pointer: Pointer, layout: Layout, scene: Scene, frame: Rect) -> list[Action]:
    """Go to the view that was clicked."""
    is_click = pointer.is_released and pointer.drag_distance <= DRAG_THRESHOLD
    view = view_at(frame, scene.grid, layout.ui_scale, pointer.x, pointer.y) if is_click else None
    return [] if view is None else [do(lens.move_eye, scene.grid.offset(*view))]


def _grabbed_handle(pointer: Pointer, layout: Layout, state: AppState, picture: Rect) -> int | None:
    """Which tilt handle is dragged: the one taken already, else the nearer one the press was close to."""
    handles = state.tilt_handles
    if handles is None:
        return None
    if handles.taken is not None:
        return handles.taken
    distances = [math.hypot(x - pointer.pressed_x, y - pointer.pressed_y) for x, y in handle_points(handles, picture)]
    nearest = distances.index(min(distances))
    return nearest if distances[nearest] <= HANDLE_REACH * layout.ui_scale else None


def _eye_drag(pointer: Pointer, layout: Layout, scene: Scene, eye: ViewOffset) -> list[Action]:
    """Content follows the hand: a point of disparity d goes d px left for a step right, so the eye goes against it.

    What it moved before it counted as a drag is caught up, and what it moved in the frame of its release counts.
    """
    step_x, step_y = pointer.step_x, pointer.step_y
    if pointer.becomes_drag:
        step_x, step_y = pointer.x - pointer.pressed_x, pointer.y - pointer.pressed_y
    if not (step_x or step_y):
        return []
    per_view = units_per_view(layout, scene)
    return [do(lens.move_eye, ViewOffset(eye.t - step_y / per_view, eye.s - step_x / per_view))]


def units_per_view(layout: Layout, scene: Scene) -> float:
    """Window units of drag for one view step.

    As far as the nearest surface moves on screen, so that it sticks to the pointer; but no finer than crosses the grid
    in `DRAG_ACROSS_GRID` of what is seen of the picture, or scenes of little parallax would be too touchy.
    """
    assert layout.picture is not None
    assert layout.frame is not None
    nearest = scene.disparity_range_px[1] * layout.picture.width / scene.width
    return max(nearest, DRAG_ACROSS_GRID * layout.frame.width / max(scene.grid.columns - 1, 1))
