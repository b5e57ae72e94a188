"""What an export is made with where the user left it open, and that the window asks for all that kinds heed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iibr_core.exports.kinds import EXPORTS
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.settings import resolve_settings, shear_margin
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape

SCENE = Scene(Source("a.png"), "a", 741, 500, GridShape(5, 4), (-1.0, 2.0), "file")
SHARP_NEAR = Optics(focus_disparity=10.0)


@pytest.mark.parametrize(
    ("kind", "size", "frames", "rate"),
    [
        ("mp4", (740, 500), 120, 30),
        ("gif", (480, 324), 60, 15),
        ("webp", (741, 500), 100, 25),
        ("focal-stack", (741, 500), 16, 0),
        ("aperture-sweep-exr", (741, 500), 9, 0),
    ],
)
def test_usual_settings(kind: str, size: tuple[int, int], frames: int, rate: float) -> None:
    settings = resolve_settings(EXPORTS[kind], ExportOptions(), SCENE, SHARP_NEAR)
    assert (settings.size, settings.frames, settings.rate, settings.eyes, settings.row) == (size, frames, rate, 3, 250)


def test_what_is_said_counts() -> None:
    said = ExportOptions(ScreenSize(10, 20), "go", 0.0, "swing", None, 7, 3.5, 0)
    settings = resolve_settings(EXPORTS["mp4"], said, SCENE, SHARP_NEAR)
    assert (settings.size, settings.frames, settings.rate, settings.eyes, settings.row) == ((10, 20), 7, 3.5, 0, 0)
    assert resolve_settings(EXPORTS["mp4"], replace(said, frames=None), SCENE, SHARP_NEAR).frames == 14, "four seconds"


def test_pictures_for_eyes_are_as_wide_as_what_both_hold() -> None:
    """Of 4 views the middle lies half a step beside view 2: the left eye stands 2 steps from it, moved by 20 px."""
    assert shear_margin(SCENE, SHARP_NEAR, 3.0) == pytest.approx(20 / 741)
    assert resolve_settings(EXPORTS["sbs"], ExportOptions(), SCENE, SHARP_NEAR).size == (741 - 40, 500)
    assert resolve_settings(EXPORTS["sbs"], ExportOptions(), SCENE, Optics(focus_disparity=1e6)).size == (1, 500), (
        "refused later"
    )
