import cv2
import numpy as np
import pytest

from benchmarks.scenes import network_like
from iibr_core.depth.edges.blur import measure_edge_blur
from iibr_core.depth.edges.refine import refine
from iibr_core.formats.maps.resample import resample_map
from iibr_core.training.degradation import blur
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import FloatImage, ImageSize, ViewOffset
from tests.iibr_core.depth.edges.test_refine import disc_before_slope
from tests.iibr_core.scenes import smooth_texture


@pytest.mark.parametrize(
    ("sigma", "size", "measured"), [(1.0, 160, 1.0), (4.0, 160, 4.0), (8.0, 180, 8.0), (8.0, 140, 0), (0.0, 160, 0)]
)
def test_the_blur_of_a_map_is_measured_unless_it_is_exact_or_too_small(sigma, size, measured) -> None:
    photo, disparity, _ = disc_before_slope(size)
    soft = blur(disparity, sigma) if sigma else disparity
    np.testing.assert_allclose(measure_edge_blur(photo, soft), measured, rtol=0.15)


def test_an_edge_that_the_photo_does_not_share_proves_nothing() -> None:
    photo, disparity, _ = disc_before_slope(160)
    soft = blur(disparity, 2.0)
    assert measure_edge_blur(photo, soft) > 0
    for other in (np.full_like(photo, 0.5), smooth_texture(160, 160)):
        assert measure_edge_blur(other, soft) == 0


MAP_SIZE = ImageSize(240, 320)
SMALL_SIZE = (107, 80)
"""(width, height), as OpenCV has it."""


def drawn(seed: int) -> tuple[FloatImage, FloatImage]:
    photo, exact = render(random_scene(np.random.default_rng(seed), MAP_SIZE, 2.0), MAP_SIZE, ViewOffset(0, 0))
    return np.ascontiguousarray(photo, np.float32), exact


def soft(exact: FloatImage) -> FloatImage:
    small = cv2.resize(exact, SMALL_SIZE, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), 1.2))


def test_a_soft_map_becomes_a_ramp_and_an_exact_one_stays_a_step() -> None:
    step = np.zeros((20, 20), np.float32)
    step[:, 10:] = 8
    assert set(np.unique(resample_map(step, ImageSize(60, 60)))) == {0.0, 8.0}
    ramp = resample_map(np.asarray(cv2.GaussianBlur(step, (0, 0), 1.2)), ImageSize(60, 60))[30]
    assert (np.diff(ramp) >= 0).all()
    assert np.diff(ramp).max() < 1.2


@pytest.mark.parametrize("make", [soft, lambda exact: network_like(exact, 1)])
def test_refining_brings_small_maps_nearer_to_the_truth(make) -> None:
    before = after = 0.0
    for seed in range(2):
        photo, exact = drawn(seed)
        values = resample_map(make(exact), MAP_SIZE)
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
