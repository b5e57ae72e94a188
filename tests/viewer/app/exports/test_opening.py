"""What exports are given: the whole photo, whatever the window shows first."""

from __future__ import annotations

from pathlib import Path

import pytest

from iibr_core.types import GridShape
from tests.viewer.background.test_scene_worker import write_large_photo
from viewer.app.exports.opening import open_undrawn
from viewer.model.state.scene import Source


@pytest.mark.parametrize("needs_disparity", [False, True])
def test_a_large_photo_is_exported_whole(tmp_path: Path, needs_disparity: bool) -> None:
    source = Source(str(write_large_photo(tmp_path)), grid=GridShape(3, 3))
    made = open_undrawn(source, 1.0, needs_disparity, lambda scene: None)
    assert made.loaded is not None
    assert (made.scene.size, made.scene.is_sketch) == ((1600, 1200), False)
    assert made.centre.colors.shape == (1200, 1600, 3)
