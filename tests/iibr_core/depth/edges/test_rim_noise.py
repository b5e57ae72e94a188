"""Noise of rims, against a slow twin and on surfaces whose rims are known."""

import numpy as np
import pytest

from iibr_core.depth.edges import rim_noise
from iibr_core.depth.edges.rim_noise import ALIKE, LEAST_WEIGHT, NEARNESS, OUTLIER, REACH_PX, UNLIKE_WEIGHT, steady_rims
from iibr_core.depth.edges.rim_sides import step_distance
from iibr_core.runtime.tiling import Cancelled, never

SIZE, STEP = (60, 90), 0.5


def disc(height=6.0):
    """A wall at 0 and a disc before it; where the disc is; how far each pixel is from its middle."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    radius = np.hypot(y - 30, x - 40)
    return np.where(radius < 20, height, 0).astype(np.float32), radius < 20, radius


def noisy_rims(values, deviation=0.08):
    noise = np.random.default_rng(5).normal(0, deviation, SIZE).astype(np.float32)
    return values + np.where(step_distance(values, STEP) <= 2, noise, np.float32(0))


def photo_of(front):
    return np.repeat(np.where(front, 0.2, 0.8)[..., None], 3, axis=2).astype(np.float32)


def slow_mean(colors, values, distance, pixel):
    """The mean along a rim, from a list of all pixels that count."""
    y, x = divmod(pixel, SIZE[1])
    found = []
    for v, u in np.ndindex(*SIZE):
        if max(abs(v - y), abs(u - x)) > REACH_PX or distance[v, u] != distance[y, x]:
            continue
        if abs(values[v, u] - values[y, x]) <= STEP:
            likeness = np.exp(-0.5 * np.sum((colors[v, u] - colors[y, x]) ** 2) / ALIKE**2)
            found.append((values[v, u], (likeness + UNLIKE_WEIGHT) * NEARNESS[v - y + REACH_PX, u - x + REACH_PX]))
    value, weight = np.transpose(found)
    if weight.sum() < LEAST_WEIGHT:
        return np.nan
    off = np.abs(value - np.average(value, weights=weight))
    limit = OUTLIER * np.average(off, weights=weight)
    return np.average(value, weights=weight * [limit / o if o > limit else 1 for o in off])


def test_means_along_rims_are_those_of_a_list():
    values, front, _ = disc()
    values = noisy_rims(values)
    values[3, 3] = 9.0  # a crumb: no rim goes on from there
    colors = photo_of(front) + np.random.default_rng(1).uniform(0, 0.1, (*SIZE, 3)).astype(np.float32)
    distance = step_distance(values, STEP)
    pixels = np.append(np.flatnonzero(distance <= 1)[::7], 3 * SIZE[1] + 3)
    means = rim_noise._mean_along(colors, values, distance, STEP, pixels)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(means)), len(means) - 1)
    np.testing.assert_allclose(means, [slow_mean(colors, values, distance, p) for p in pixels], rtol=1e-5, atol=1e-5)


def test_rims_that_waver_more_than_insides_are_smoothed():
    values, front, _ = disc()
    given = noisy_rims(values)
    steadied = steady_rims(photo_of(front), given, STEP, never)
    rim = step_distance(values, STEP) <= 2
    assert np.abs(steadied - values)[rim].mean() < 0.5 * np.abs(given - values)[rim].mean()
    np.testing.assert_array_equal(steadied[~rim], given[~rim])


def test_what_goes_is_the_share_of_the_variance_that_insides_do_not_have():
    """Noise twice as strong beside edges has four times the variance: three quarters of every deviation go."""
    off = np.random.default_rng(2).normal(0, 0.1, 400).astype(np.float32)
    unknown = np.float32([np.nan, np.nan])
    assert rim_noise._noise_share(np.append(2 * off, unknown), np.append(unknown, off)) == pytest.approx(0.75)
    assert rim_noise._noise_share(off, 2 * off) == 0
    assert rim_noise._noise_share(2 * off, off[: rim_noise.LEAST_SAMPLES - 1]) == 0
    assert rim_noise._noise_share(2 * off, off[: rim_noise.LEAST_SAMPLES]) > 0


def test_maps_that_waver_as_much_everywhere_stay():
    values, front, _ = disc()
    given = values + np.random.default_rng(5).normal(0, 0.08, SIZE).astype(np.float32)
    np.testing.assert_array_equal(steady_rims(photo_of(front), given, STEP, never), given)


def test_round_fronts_stay_round():
    values, front, radius = disc()
    bends = (0.02 * np.maximum(radius - 14, 0) ** 2).astype(np.float32)
    round_disc = values - np.where(front, bends, np.float32(0))
    given = noisy_rims(round_disc, 0.05)
    steadied = steady_rims(photo_of(front), given, STEP, never)
    rim = step_distance(values, STEP) <= 2
    assert bends[front & rim].mean() > 0.3
    assert np.abs((steadied - round_disc)[front & rim].mean()) < 0.02


def test_cancelling():
    values, front, _ = disc()
    with pytest.raises(Cancelled):
        steady_rims(photo_of(front), noisy_rims(values), STEP, lambda: True)
