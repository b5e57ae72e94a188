"""The benchmark of the lens: its reference against the scene, and figures of a small field."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.harness.bench_scenes import BenchScene
from benchmarks.refocus import Reference, figures_of, times_of
from iibr_core.evaluation.metrics import psnr
from iibr_core.types import ViewOffset
from tests.iibr_core.known_scenes import WALL, disparity_of_square, offsets_of, view_of_square
from viewer.gpu.context import GLContext


@pytest.fixture(scope="module")
def scene() -> BenchScene:
    field = tuple(offsets_of(5, 5).values())
    return BenchScene("square", view_of_square(ViewOffset(0.0, 0.0)), disparity_of_square(), {}, field)


def test_the_reference_through_a_small_hole_is_the_view_there(scene: BenchScene) -> None:
    eye = ViewOffset(0.5, -1.0)
    (picture,) = Reference(scene).pictures(eye, 0.01, [0.0])
    assert psnr(picture, view_of_square(eye)) > 38


def test_what_is_in_focus_is_sharp_in_the_reference(scene: BenchScene) -> None:
    near, far = Reference(scene).pictures(ViewOffset(0.0, 0.0), 3.0, [2.0, WALL])
    is_near = scene.disparity == 2.0
    away = [np.median(np.abs(picture - scene.photo)[is_near]) for picture in (near, far)]
    assert 3 * away[0] < away[1]
    assert away[0] < 0.01


def test_every_lens_is_measured(scene: BenchScene, gl: GLContext) -> None:
    found = figures_of(gl, scene, 3)
    assert len(found.settled) == len(found.first_db) == 27
    assert min(found.settled) > 30
    assert min(found.interface) > 35
    assert max(found.first_mean) < 0.01
    assert 0.9 < found.sharpness < 1.1
    assert all(found.row)
    first, settled, *ratios = map(float, times_of(gl, scene, 1))
    assert 0 < first <= settled
    assert min(ratios) > 0
