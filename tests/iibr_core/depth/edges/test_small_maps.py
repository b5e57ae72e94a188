import cv2
import numpy as np
import pytest

from benchmarks.scenes import network_like
from iibr_core.depth.edges.map_alignment import lies_at_corners
from iibr_core.depth.edges.refine import refine
from iibr_core.formats.maps.resample import has_soft_edges, resample_map
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import FloatImage, ImageSize, ViewOffset

SIZE = ImageSize(240, 320)
SMALL = (107, 80)
"""(width, height), as OpenCV has it."""


def drawn(seed: int) -> tuple[FloatImage, FloatImage]:
    photo, exact = render(random_scene(np.random.default_rng(seed), SIZE, 2.0), SIZE, ViewOffset(0, 0))
    return np.ascontiguousarray(photo, np.float32), exact


def soft(exact: FloatImage) -> FloatImage:
    small = cv2.resize(exact, SMALL, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), 1.2))


@pytest.mark.parametrize("seed", range(2))
def test_soft_and_exact_maps_are_told_apart(seed) -> None:
    exact = drawn(seed)[1]
    assert has_soft_edges(soft(exact))
    assert has_soft_edges(cv2.resize(exact, SMALL, interpolation=cv2.INTER_AREA))
    assert not has_soft_edges(cv2.resize(exact, SMALL, interpolation=cv2.INTER_NEAREST_EXACT))
    for value in (np.nan, 0.0, np.inf):
        assert not has_soft_edges(np.full((9, 9), value, np.float32))


def test_a_soft_map_becomes_a_ramp_and_an_exact_one_stays_a_step() -> None:
    step = np.zeros((20, 20), np.float32)
    step[:, 10:] = 8
    assert set(np.unique(resample_map(step, ImageSize(60, 60)))) == {0.0, 8.0}
    ramp = resample_map(np.asarray(cv2.GaussianBlur(step, (0, 0), 1.2)), ImageSize(60, 60))[30]
    assert (np.diff(ramp) >= 0).all()
    assert np.diff(ramp).max() < 1.2


@pytest.mark.parametrize("seed", [1, 2])
def test_maps_made_by_leaving_out_pixels_lie_at_corners_and_others_do_not(seed) -> None:
    photo, exact = drawn(seed)
    assert lies_at_corners(photo, cv2.resize(exact, SMALL, interpolation=cv2.INTER_NEAREST))
    for kind in (cv2.INTER_AREA, cv2.INTER_NEAREST_EXACT):
        assert not lies_at_corners(photo, cv2.resize(exact, SMALL, interpolation=kind))
    for other in (soft(exact), exact, np.full((60, 80), np.nan, np.float32)):
        assert not lies_at_corners(photo, other)


@pytest.mark.parametrize("make", [soft, lambda exact: network_like(exact, 1)])
def test_refining_brings_small_maps_nearer_to_the_truth(make) -> None:
    before = after = 0.0
    for seed in range(2):
        photo, exact = drawn(seed)
        values = resample_map(make(exact), SIZE)
        refined = refine(photo, values, is_enlarged=True)
        before += float((np.abs(values - exact) > 0.1 * np.ptp(exact)).mean())
        after += float((np.abs(refined - exact) > 0.1 * np.ptp(exact)).mean())
    assert after < 0.75 * before


def test_a_very_soft_map_is_sharpened_at_a_smaller_size() -> None:
    photo, exact = drawn(2)
    values = np.asarray(cv2.GaussianBlur(exact, (0, 0), 6.0))
    refined = refine(photo, values)
    wrong = [float((np.abs(each - exact) > 0.1 * np.ptp(exact)).mean()) for each in (values, refined)]
    assert wrong[1] < 0.7 * wrong[0]
