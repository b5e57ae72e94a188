"""Limits of the lens: what a slider's ends must include, whatever a scene's disparity is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from iibr_core.beyond.optics import CENTRE, Optics
from iibr_core.scenes.lens_limits import LensChoice, clamp_optics, focus_limits
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import Scene, SceneReady, SceneRequest, Source
from iibr_core.types import GridShape

RANGES = [(-1.0, 2.0), (1.0, 4.0), (-3.0, -1.0), (2.0, -1.0), (-1.0, -3.0), (0.0, 2.0), (-2.0, 0.0), (0.0, 0.0)]


@pytest.mark.parametrize("range_px", RANGES)
def test_the_focus_goes_from_beyond_one_end_over_the_still_plane_to_the_other(range_px: tuple[float, float]) -> None:
    """Also where all lies before the plane that stays still, all behind it, or near and far are exchanged."""
    scene = Scene(Source("a.png"), "a", 96, 64, GridShape(5, 5), range_px, "file")
    low, high = focus_limits(scene)
    assert low < min(*range_px, 0.0) <= max(*range_px, 0.0) < high
    for focus in (*range_px, 0.0):
        assert clamp_optics(Optics(focus_disparity=focus), scene).focus_disparity == focus
        assert LensChoice(focus=focus).optics_on(scene).focus_disparity == focus


@pytest.mark.parametrize("strength", [1.0, -1.0])
@pytest.mark.parametrize("still", [None, -4.0, 5.0])
def test_a_photo_whose_still_plane_lies_anywhere_may_be_focused_on_it(
    photo_path: Path, still: float | None, strength: float
) -> None:
    source = Source(str(photo_path), grid=GridShape(3, 3), focus_disparity=still)
    ready = next(results_of(SceneRequest(1, source, strength), lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    low, high = focus_limits(ready.scene)
    least, most = ready.scene.disparity_range_px
    assert low < min(least, 0.0) <= max(most, 0.0) < high
    assert (least <= 0 <= most) == (still is None)
    turned = replace(ready.scene, disparity_range_px=(most, least))
    assert focus_limits(turned) == (low, high)
