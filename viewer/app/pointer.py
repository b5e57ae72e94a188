"""The mouse -> actions: one function reads it from ImGui, pure functions map it to actions."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from imgui_bundle import imgui

from iibr_core.scenes.lens_limits import focus_limits
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewOffset
from viewer.model import depth, inspection, lens, selection, viewpoint
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.depth import DepthSample
from viewer.model.focal_plane import handle_points, place_of
from viewer.model.inspection import Hover, view_at
from viewer.model.layout import Layout, pixel_at

DRAG_THRESHOLD = 4.0
"""Distance, in window units, from which on a press is a drag and no click."""
DRAG_ACROSS_GRID = 0.6
"""Shortest drag from one side of the grid to the other, as a share of the visible width."""
FOCUS_STEPS = 40
"""Notches of the wheel from the nearest focus to the farthest."""
BRUSH_NOTCH = 1.15
"""Factor of the brush's size for a notch of the wheel."""
HANDLE_REACH = 14.0
"""Largest distance at which a press takes a tilt handle, in window units at usual size."""
DIVIDER_REACH = 8.0
"""Largest distance at which a press takes the divider, in window units at usual size."""
PANEL_CLICK_S, PANEL_REACH = 0.6, 8.0
"""Time and distance (window units) within which a second press belongs to the panel of the first, which may be gone."""


@dataclass(frozen=True)
class Pointer:
    """The mouse in one frame, in window units. step_x, step_y: movement since the previous frame.

    drag_distance: largest distance from the press, the frame of the release included. becomes_drag: whether this frame
    makes it a drag. pulls: the middle button is down, so the drag moves the picture. holds_ctrl: Ctrl is down, or was
    at the beginning. holds_panel: the press that is held was on a panel. panel_press: place and time (seconds) of
    the last press on a panel.
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
    holds_ctrl: bool = False
    pulls: bool = False
    holds_panel: bool = False
    panel_press: tuple[float, float, float] = (0.0, 0.0, -math.inf)

    @property
    def is_held(self) -> bool:
        """Whether the left button is down, or was released in this frame."""
        return self.is_down or self.is_released

    @property
    def is_drag(self) -> bool:
        """Whether the press moved too far for a click."""
        return self.drag_distance > DRAG_THRESHOLD


NO_POINTER = Pointer()
Pick = Callable[[float, float], float | None]
"""Function that returns the disparity at a pixel of the picture, None if it is unknown."""


@dataclass(frozen=True)
class _Hand:
    """The pointer over a picture. frame: the visible part of the picture."""

    pointer: Pointer
    layout: Layout
    state: AppState
    scene: Scene
    picture: Rect
    frame: Rect
    pick: Pick

    @property
    def is_over_frame(self) -> bool:
        """Whether the pointer is over the visible picture."""
        return self.frame.contains(self.pointer.x, self.pointer.y)

    @property
    def began_in_frame(self) -> bool:
        """Whether the press was in the visible picture."""
        return self.frame.contains(self.pointer.pressed_x, self.pointer.pressed_y)

    @property
    def pixel(self) -> tuple[float, float]:
        """Pixel (x, y) of the picture under the pointer."""
        return pixel_at(self.picture, self.scene.size, self.pointer.x, self.pointer.y)

    def place_in_photo(self) -> tuple[tuple[float, float], float]:
        """Return where the photo shows the surface under the pointer, in shares of its size, and its disparity."""
        x_px, y_px = self.pixel
        disparity, eye = self.pick(x_px, y_px) or 0.0, self.scene.in_columns(self.state.optics.eye)
        x_px, y_px = x_px + disparity * eye.s, y_px + disparity * eye.t
        return ((x_px + 0.5) / self.scene.width, (y_px + 0.5) / self.scene.height), disparity


def read_pointer(before: Pointer = NO_POINTER) -> Pointer:
    """Return the mouse in this ImGui frame. before: the mouse in the previous frame."""
    io = imgui.get_io()
    moved = imgui.get_mouse_drag_delta(imgui.MouseButton_.left, 0.0)
    # ImGui leaves out the frame of the release, which may hold all of a quick drag.
    drag_distance = max(float(io.mouse_drag_max_distance_sqr[0]) ** 0.5, math.hypot(moved.x, moved.y))
    was_drag = before.is_down and not io.mouse_clicked[0] and before.is_drag
    ctrl_keys = imgui.Key.left_ctrl, imgui.Key.right_ctrl, imgui.Key.left_super, imgui.Key.right_super
    middle = imgui.MouseButton_.middle
    # In the frame of the press, the step led to the place of the press.
    step = imgui.ImVec2(0.0, 0.0) if io.mouse_clicked[middle] else io.mouse_delta
    now_s, is_pressed, is_over_panel = time.perf_counter(), bool(io.mouse_clicked[0]), bool(io.want_capture_mouse)
    if is_pressed:
        x, y, pressed_s = before.panel_press
        is_close = math.hypot(io.mouse_pos.x - x, io.mouse_pos.y - y) < PANEL_REACH
        is_over_panel |= is_close and now_s - pressed_s < PANEL_CLICK_S
    is_held = is_pressed or bool(io.mouse_down[0] or io.mouse_released[0])
    holds_panel = is_over_panel if is_pressed else before.holds_panel and is_held
    return Pointer(
        x=io.mouse_pos.x,
        y=io.mouse_pos.y,
        step_x=step.x,
        step_y=step.y,
        drag_distance=drag_distance,
        becomes_drag=drag_distance > DRAG_THRESHOLD and not was_drag,
        pressed_x=io.mouse_pos.x - moved.x,
        pressed_y=io.mouse_pos.y - moved.y,
        is_down=bool(io.mouse_down[0]),
        is_pressed=is_pressed,
        is_released=bool(io.mouse_released[0]),
        clicks=int(io.mouse_clicked_last_count[0]),
        wheel=io.mouse_wheel,
        is_over_panel=is_over_panel or holds_panel,
        # The wheel may have turned in the frame in which Ctrl was released.
        holds_ctrl=any(imgui.is_key_down(key) or imgui.is_key_released(key) for key in ctrl_keys),
        pulls=imgui.is_mouse_down(middle) or imgui.is_mouse_released(middle),
        holds_panel=holds_panel,
        panel_press=(io.mouse_pos.x, io.mouse_pos.y, now_s) if is_pressed and is_over_panel else before.panel_press,
    )


def actions_from_pointer(pointer: Pointer, layout: Layout, state: AppState, pick: Pick) -> list[Action]:
    """Return the actions of the mouse. Drags and clicks count if they began in the picture."""
    scene, picture = state.scene, layout.picture
    if scene is None or picture is None or pointer.is_over_panel:
        return []
    hand = _Hand(pointer, layout, state, scene, picture, layout.frame or picture, pick)
    if state.inspection.shows_views:
        return _on_sheet(hand)
    if (zoom := _zoom(hand)) is not None:
        return zoom
    if is_marking_gloss(state):
        return _gloss_actions(hand)
    if is_brushing(state):
        return _paint_actions(hand)
    if pointer.wheel and hand.is_over_frame:
        low, high = focus_limits(scene)
        return [do(lens.set_focus, state.optics.focus_disparity + pointer.wheel * (high - low) / FOCUS_STEPS)]
    if not hand.began_in_frame:
        return []
    if pointer.is_held and pointer.is_drag:
        return _drag(hand)
    return _click(hand) if pointer.is_released else []


def actions_from_hover(pointer: Pointer, layout: Layout, state: AppState, pick: Pick) -> list[Action]:
    """Return the place of the pointer in the picture if it is new. A pointer that drags has no place."""
    scene, picture, frame, hover = state.scene, layout.picture, layout.frame, None
    paints = is_brushing(state) or is_marking_gloss(state)
    is_busy = pointer.pulls or _is_on_minimap(layout, pointer.x, pointer.y) or state.inspection.shows_views
    is_pointing = not (pointer.is_over_panel or is_busy) and (paints or not (pointer.is_down and pointer.is_drag))
    if scene is not None and picture and frame and is_pointing and frame.contains(pointer.x, pointer.y):
        pixel = pixel_at(picture, scene.size, pointer.x, pointer.y)
        hover = Hover(*pixel, pick(*pixel))
    return [do(inspection.set_hover, hover)] if hover != state.hover else []


def is_brushing(state: AppState) -> bool:
    """Return whether dragging over the picture paints depth."""
    scene = state.scene
    return state.brush.is_on and scene is not None and scene.plan is not None and not scene.is_sketch


def is_marking_gloss(state: AppState) -> bool:
    """Return whether dragging over the picture marks the glossy surface."""
    return state.gloss_brush.is_on and state.optics.gloss is not None and state.scene is not None


def units_per_view(layout: Layout, scene: Scene) -> float:
    """Return the window units of drag for one view step.

    The nearest surface sticks to the pointer, unless its parallax is so small that the viewpoint would be too touchy:
    a drag across the grid takes at least `DRAG_ACROSS_GRID` of the visible width.
    """
    assert layout.picture is not None
    assert layout.frame is not None
    nearest = scene.disparity_range_px[1] * layout.picture.width / scene.width
    return max(nearest, DRAG_ACROSS_GRID * layout.frame.width / max(scene.grid.columns - 1, 1))


def _is_on_minimap(layout: Layout, x: float, y: float) -> bool:
    return layout.minimap is not None and layout.minimap.contains(x, y)


def _zoom(hand: _Hand) -> list[Action] | None:
    """Zoom about the pointer, pull the picture, or show a place of the minimap; None if the mouse does neither."""
    pointer, layout = hand.pointer, hand.layout
    if pointer.wheel and pointer.holds_ctrl and hand.is_over_frame:
        return [do(viewpoint.set_zoom, layout.zoomed(pointer.wheel, pointer.x, pointer.y))]
    if pointer.pulls:
        is_pulled = layout.is_zoomed and (pointer.step_x or pointer.step_y)
        return [do(viewpoint.set_zoom, layout.pulled(pointer.step_x, pointer.step_y))] if is_pulled else []
    if pointer.is_held and _is_on_minimap(layout, pointer.pressed_x, pointer.pressed_y):
        return [do(viewpoint.set_zoom, layout.shown_on_minimap(pointer.x, pointer.y))]
    return None


def _paint_actions(hand: _Hand) -> list[Action]:
    """Return the actions of a tool: it paints on the surface under the pointer, picks its depth (Ctrl), or selects it.
    The wheel sets the size of the brush, or the tolerance of the selection, which drags add to and erase from (Ctrl).
    """
    pointer, stroke, brush = hand.pointer, hand.state.stroke, hand.state.brush
    if pointer.wheel and hand.is_over_frame:
        name, factor = "tolerance" if brush.tool == "select" else "radius", BRUSH_NOTCH**pointer.wheel
        return [do(depth.set_brush, replace(brush, **{name: getattr(brush, name) * factor}))]
    if brush.tool == "select":
        return _selecting_actions(hand)
    begins = pointer.is_pressed and hand.began_in_frame
    if not pointer.is_down or not (begins or stroke is not None):
        return []
    place, disparity = hand.place_in_photo()
    if stroke is None and pointer.holds_ctrl:
        return [do(depth.pick, DepthSample(place, disparity))]
    return [do(depth.paint, place)]


def _selecting_actions(hand: _Hand) -> list[Action]:
    """Select the surface that was clicked; a drag, or Ctrl+click, changes the selection by the brush."""
    pointer = hand.pointer
    if not (hand.began_in_frame and pointer.is_held):
        return []
    is_click = pointer.is_released and not pointer.is_drag
    if is_click and not pointer.holds_ctrl:
        return [do(selection.select, hand.place_in_photo()[0])]
    if is_click or pointer.is_drag:
        place, begins = hand.place_in_photo()[0], is_click or pointer.becomes_drag
        return [do(selection.paint, place, erases=pointer.holds_ctrl, begins=begins)]
    return []


def _gloss_actions(hand: _Hand) -> list[Action]:
    """Mark the surface under the pointer; the wheel changes the brush's size."""
    pointer, brush = hand.pointer, hand.state.gloss_brush
    if pointer.wheel and hand.is_over_frame:
        return [do(lens.take_gloss_brush, replace(brush, radius=brush.radius * BRUSH_NOTCH**pointer.wheel))]
    if not pointer.is_down or not hand.began_in_frame:
        return []
    place, _ = hand.place_in_photo()
    return [do(lens.paint_gloss, place, brush, begins=pointer.is_pressed)]


def _on_sheet(hand: _Hand) -> list[Action]:
    """Go to the view that was clicked."""
    pointer, grid = hand.pointer, hand.scene.grid
    if not pointer.is_released or pointer.is_drag:
        return []
    view = view_at(hand.frame, grid, hand.layout.ui_scale, pointer.x, pointer.y)
    return [] if view is None else [do(lens.move_eye, grid.offset(*view))]


def _click(hand: _Hand) -> list[Action]:
    """Focus on the surface under the pointer; a double click returns to the middle."""
    if _grabs_divider(hand):
        return []
    if hand.pointer.clicks > 1:
        return [do(viewpoint.return_home, takes_back_click=True)]
    disparity = hand.pick(*hand.pixel)
    return [] if disparity is None else [do(lens.focus_on, place_of(*hand.pixel, hand.scene), disparity)]


def _drag(hand: _Hand) -> list[Action]:
    """Drag the divider, a tilt handle, or the viewpoint."""
    if _grabs_divider(hand):
        return [do(inspection.move_divider, (hand.pointer.x - hand.frame.x) / hand.frame.width)]
    index = _grabbed_handle(hand)
    if index is None:
        return _eye_drag(hand)
    return [do(lens.move_tilt_handle, index, place_of(*hand.pixel, hand.scene), hand.pick(*hand.pixel))]


def _grabs_divider(hand: _Hand) -> bool:
    """Return whether the press was close to the divider, or it is being dragged."""
    shown = hand.state.inspection
    if shown.comparison is None:
        return False
    x = hand.frame.x + shown.divider * hand.frame.width
    return shown.divider_taken or abs(hand.pointer.pressed_x - x) <= DIVIDER_REACH * hand.layout.ui_scale


def _grabbed_handle(hand: _Hand) -> int | None:
    """Return the index of the tilt handle that is dragged: the one taken, else the nearest one within reach."""
    handles, pointer = hand.state.tilt_handles, hand.pointer
    if handles is None or handles.taken is not None:
        return None if handles is None else handles.taken
    points = handle_points(handles, hand.picture)
    distances = [math.hypot(x - pointer.pressed_x, y - pointer.pressed_y) for x, y in points]
    nearest = distances.index(min(distances))
    return nearest if distances[nearest] <= HANDLE_REACH * hand.layout.ui_scale else None


def _eye_drag(hand: _Hand) -> list[Action]:
    """Move the viewpoint against the drag, so that near surfaces follow the hand.

    The first step of a drag includes the movement before it counted as one.
    """
    pointer, eye = hand.pointer, hand.state.optics.eye
    step_x, step_y = pointer.step_x, pointer.step_y
    if pointer.becomes_drag:
        step_x, step_y = pointer.x - pointer.pressed_x, pointer.y - pointer.pressed_y
    if not (step_x or step_y):
        return []
    per_view = units_per_view(hand.layout, hand.scene)
    return [do(lens.move_eye, ViewOffset(eye.t - step_y / per_view, eye.s - step_x / per_view))]
