"""What the keys ask for."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.types import GridShape, ViewOffset
from viewer.app.keys import Keys, actions_from_keys
from viewer.model.actions import ShowPrompt, Undo
from viewer.model.commands import BY_NAME
from viewer.model.state.app_state import AppState
from viewer.model.state.optics import MoveEye, ResetOptics
from viewer.model.state.scene import Scene, Source

SCENE = Scene(Source("photo.png", max_pixels=7), "photo", 600, 400, GridShape(9, 9), (-2.0, 3.0), "photo.pfm")
STATE = AppState(source=SCENE.source, scene=SCENE)


def test_keys() -> None:
    assert actions_from_keys(Keys(), STATE) == []
    reset = "Reset viewpoint, focus and aperture"
    assert actions_from_keys(Keys(is_escape=True, commands=(reset, "Undo")), STATE) == [ResetOptics(), Undo()]
    assert actions_from_keys(Keys(is_escape=True), replace(STATE, prompt="help")) == [ShowPrompt(None)]
    assert reset in BY_NAME
    (move,) = actions_from_keys(Keys(arrows=ViewOffset(1, -1)), STATE)
    assert isinstance(move, MoveEye)
    assert move.eye.t > 0 > move.eye.s
