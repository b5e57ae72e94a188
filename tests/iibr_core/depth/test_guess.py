"""The guess at depth without a model: its pieces against slow twins, and pictures that give it little."""

from __future__ import annotations

import heapq

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from iibr_core.depth.geodesic import spread_distances
from iibr_core.depth.guess import PIXEL_COST, box_filter, guess_depth
from tests.iibr_core.scenes import photo_of, square_before_wall


def slow_paths(image: np.ndarray) -> np.ndarray:
    """Dijkstra from the upper border."""
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


@settings(max_examples=8)
@example(1, 500, 1.0, 0)
@example(500, 1, 1.0, 0)
@given(st.integers(1, 30), st.integers(1, 30), st.sampled_from([0.0, 1.0, 60000.0]), st.integers(0, 9))
def test_any_photo_gives_a_finite_map_of_its_size(height: int, width: int, brightest: float, seed: int) -> None:
    pixels = np.random.default_rng(seed).random((height, width, 3)) * brightest
    values = guess_depth(photo_of(pixels, is_hdr=brightest > 1)).values
    assert values.shape == (height, width)
    assert values.dtype == np.float32
    assert np.isfinite(values).all()
