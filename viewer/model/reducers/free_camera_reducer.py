"""What becomes of the state when the camera leaves the plane of the views, or goes back."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.free_camera import (
    CameraProgress,
    FreeCamera,
    FreeCameraAction,
    LeaveCamera,
    moved,
)
from viewer.model.messages import notify
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice

FOR_PHOTOS = "A light field from disk has views from its own plane only: open a photo to look around."


def reduce_free_camera(state: AppState, action: FreeCameraAction) -> AppState:
    """The state after one of these actions. The lens is the free camera's, too."""
    if isinstance(action, LeaveCamera):
        return replace(state, free_camera=None)
    if isinstance(action, CameraProgress):
        return replace(state, free_progress=action.done)
    if state.scene is None:
        return state
    if state.scene.plan is None:
        return notify(state, Notice(FOR_PHOTOS))
    camera = state.free_camera or FreeCamera()
    return replace(state, free_camera=moved(camera, action))
