import heapq

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from iibr_core.depth.geodesic import spread_distances
from iibr_core.depth.guess import PIXEL_COST, box_filter, guess_depth, size_within
from iibr_core.depth.subject import subject_disparity
from iibr_core.types import ImageSize
from tests.iibr_core.scenes import photo_of, square_before_wall


def slow_paths(image: np.ndarray) -> np.ndarray:
    height, width = image.shape[:2]
    way = np.full((height, width), np.inf)
    queue = [(0.0, 0, x) for x in range(width)]
    while queue:
        length, y, x = heapq.heappop(queue)
        if length >= way[y, x]:
            continue
        way[y, x] = length
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                step = PIXEL_COST * np.hypot(v - y, u - x) + np.linalg.norm(image[v, u] - image[y, x])
                if length + step < way[v, u]:
                    heapq.heappush(queue, (length + step, v, u))
    return way


def test_paths_are_the_shortest() -> None:
    pixels = np.random.default_rng(0).random((30, 40, 3), np.float32)
    path = np.full((30, 40), np.inf, np.float32)
    path[0] = 0
    spread_distances(pixels, PIXEL_COST, path)
    np.testing.assert_allclose(path, slow_paths(pixels), rtol=1e-4)


def test_averages_are_those_of_what_lies_inside() -> None:
    image = np.random.default_rng(0).random((7, 9, 2), np.float32)
    got = box_filter(image, 2)
    for y, x in np.ndindex(7, 9):
        expected = image[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3].mean(axis=(0, 1))
        np.testing.assert_allclose(got[y, x], expected, rtol=1e-5)


def test_what_stands_out_before_a_wall_is_closer_than_the_wall_beside_it() -> None:
    photo, truth = square_before_wall(120, 160)
    values = guess_depth(photo).values
    rows = slice(50, 70)
    in_front = truth.values[rows] > 1
    assert np.percentile(values[rows][in_front], 10) > np.percentile(values[rows][~in_front], 95)
    assert size_within(ImageSize(300, 600), 60) == (30, 60), "large photos are guessed at a small size"


@settings(max_examples=8)
@example(1, 500, 1.0, 0)
@example(500, 1, 1.0, 0)
@given(st.integers(1, 30), st.integers(1, 30), st.sampled_from([0.0, 1.0, 60000.0]), st.integers(0, 9))
def test_any_photo_gives_a_finite_map_of_its_size(height, width, brightest, seed) -> None:
    pixels = np.random.default_rng(seed).random((height, width, 3)) * brightest
    values = guess_depth(photo_of(pixels, is_hdr=brightest > 1)).values
    assert values.shape == (height, width)
    assert values.dtype == np.float32
    assert np.isfinite(values).all()


FAR, NEAR = 1.5, 2.7


def wall(seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, 0.02, (60, 80))
    return (FAR + np.linspace(0, 0.3, 60)[:, None] + noise).astype(np.float32)


def test_a_dog_that_fills_a_fifth_of_the_middle_is_the_subject_and_not_the_wall_behind_it() -> None:
    disparity = wall()
    disparity[30:, 25:45] = NEAR
    disparity[50:] = 4.3  # the basket, in front but not in the middle
    assert subject_disparity(disparity) == pytest.approx(NEAR)


def test_a_floor_and_a_wall_behind_a_twig_are_focused_on_in_their_middle() -> None:
    floor = np.linspace(0, 4, 61, dtype=np.float32)[:, None].repeat(80, 1)
    assert subject_disparity(floor) == pytest.approx(4 * 0.46, abs=0.1)
    disparity = wall()
    assert subject_disparity(disparity) == pytest.approx(FAR + 0.14, abs=0.05)
    disparity[:, 40:42] = 6.0
    assert subject_disparity(disparity) < FAR + 0.3
    assert subject_disparity(np.full((1, 1), NEAR, np.float32)) == pytest.approx(NEAR)
    assert subject_disparity(np.full((2, 3), np.nan, np.float32)) == 0.0
