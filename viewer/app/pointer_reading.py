"""The mouse, as ImGui tells it."""

from __future__ import annotations

import math

from viewer.app.pointer import DRAG_THRESHOLD, NO_POINTER, Pointer


def read_pointer(before: Pointer = NO_POINTER) -> Pointer:
    """The mouse of this ImGui frame; before: of the one before."""
    from imgui_bundle import imgui

    io = imgui.get_io()
    moved = imgui.get_mouse_drag_delta(imgui.MouseButton_.left, 0.0)
    # ImGui leaves out the frame of the release, in which a quick drag may have gone all its way.
    drag_distance = max(float(io.mouse_drag_max_distance_sqr[0]) ** 0.5, math.hypot(moved.x, moved.y))
    was_drag = before.is_down and not io.mouse_clicked[0] and before.drag_distance > DRAG_THRESHOLD
    ctrl_keys = imgui.Key.left_ctrl, imgui.Key.right_ctrl, imgui.Key.left_super, imgui.Key.right_super
    holds_space = imgui.is_key_down(imgui.Key.space) and not io.want_text_input
    is_held = bool(io.mouse_down[0] or io.mouse_released[0])
    pulls_left = is_held and (holds_space if io.mouse_clicked[0] else before.pulls and before.is_down)
    middle = imgui.MouseButton_.middle
    pulls_middle = imgui.is_mouse_down(middle) or imgui.is_mouse_released(middle)
    # In the frame of the press the mouse still moved to where it was pressed.
    is_start = bool(io.mouse_clicked[0]) if pulls_left else bool(io.mouse_clicked[middle])
    pulls = pulls_left or pulls_middle
    return Pointer(
        x=io.mouse_pos.x,
        y=io.mouse_pos.y,
        step_x=0.0 if pulls and is_start else io.mouse_delta.x,
        step_y=0.0 if pulls and is_start else io.mouse_delta.y,
        drag_distance=drag_distance,
        becomes_drag=drag_distance > DRAG_THRESHOLD and not was_drag,
        pressed_x=io.mouse_pos.x - moved.x,
        pressed_y=io.mouse_pos.y - moved.y,
        is_down=bool(io.mouse_down[0]),
        is_pressed=bool(io.mouse_clicked[0]),
        is_released=bool(io.mouse_released[0]),
        clicks=int(io.mouse_clicked_last_count[0]),
        wheel=io.mouse_wheel,
        is_over_panel=io.want_capture_mouse,
        # The wheel may have turned in the frame in which Ctrl was let go.
        holds_ctrl=any(imgui.is_key_down(key) or imgui.is_key_released(key) for key in ctrl_keys),
        pulls=pulls,
        used_space=(pulls_left or before.used_space) and (holds_space or imgui.is_key_released(imgui.Key.space)),
    )
