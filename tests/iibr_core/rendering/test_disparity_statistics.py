import numpy as np
import pytest

from iibr_core.rendering.disparity_statistics import (
    EDGE_WINDOW_PX,
    SHARP_STEP_SHARE,
    SOFT_EDGES_PX,
    STATISTICS_PX,
    find_soft_edges,
    measure_disparity,
)
from iibr_core.surfaces import SLOPE_SHARE
from iibr_core.training.degradation import blur


def slow_surroundings(disparity: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixel by pixel, as the docstring says."""
    height, width = disparity.shape
    low, high, step = (np.zeros_like(disparity) for _ in range(3))
    for y in range(height):
        for x in range(width):
            near = disparity[
                max(y - STATISTICS_PX, 0) : y + STATISTICS_PX + 1,
                max(x - STATISTICS_PX, 0) : x + STATISTICS_PX + 1,
            ]
            if np.isfinite(near).any():
                low[y, x], high[y, x] = np.nanmin(near), np.nanmax(near)
            wide = disparity[
                max(y - STATISTICS_PX, 0) : y + STATISTICS_PX + 1,
                max(x - STATISTICS_PX, 0) : x + STATISTICS_PX + 1,
            ]
            steps = [np.abs(np.diff(wide, axis=axis)).ravel() for axis in (0, 1)]
            step[y, x] = max((s for s in np.concatenate(steps) if np.isfinite(s)), default=0)
    return low, high, step


def random_disparity(rng: np.random.Generator, shape: tuple[int, int], unknown: float) -> np.ndarray:
    disparity = rng.normal(size=shape).astype(np.float32)
    disparity[rng.random(shape) < unknown] = np.nan
    return disparity


@pytest.mark.parametrize("shape", [(17, 23), (1, 9), (9, 1), (1, 1)])
@pytest.mark.parametrize("unknown", [0.0, 0.6, 1.0])
def test_surroundings_against_a_slow_twin(shape: tuple[int, int], unknown: float):
    disparity = random_disparity(np.random.default_rng(7), shape, unknown)
    around = measure_disparity(disparity[None], 4.0)
    low, high, step = slow_surroundings(disparity)
    assert around.low[0] == pytest.approx(low)
    assert around.high[0] == pytest.approx(high)
    assert around.step[0] == pytest.approx(step)


def square(size: int = 64) -> np.ndarray:
    disparity = np.zeros((size, size), np.float32)
    disparity[16:48, 16:48] = 3
    return disparity


def slow_soft(line: np.ndarray, least_edge: float) -> np.ndarray:
    """Pixel by pixel: near the middle of a slope that is flat on both sides, as far as the frame shows them."""
    soft = np.zeros(len(line), bool)
    for width in SOFT_EDGES_PX:
        for x in range(width // 2, len(line) - width - width // 2):
            change = abs(line[x + width] - line[x])
            shoulders = line[max(x - width, 0) : x + 1], line[x + width : x + 2 * width + 1]
            is_slope = np.nanmax(np.append(np.abs(np.diff(line[x : x + width + 1])), 0)) < SHARP_STEP_SHARE * change
            if (
                change >= least_edge
                and is_slope
                and all(np.nanmax(s) - np.nanmin(s) <= SLOPE_SHARE * change for s in shoulders)
            ):
                soft[max(x + width // 2 - EDGE_WINDOW_PX, 0) : x + width // 2 + EDGE_WINDOW_PX + 1] = True
    return soft


def slow_softness(disparity: np.ndarray, least_edge: float) -> float:
    left, total = [], []
    for values in (*disparity, *disparity.T):
        soft = slow_soft(values, least_edge)
        for x in range(len(values) - EDGE_WINDOW_PX):
            steps = np.abs(np.diff(values[x : x + EDGE_WINDOW_PX + 1]))
            change = abs(values[x + EDGE_WINDOW_PX] - values[x])
            is_surface = np.isfinite(steps).all() and steps.max() < SHARP_STEP_SHARE * steps.sum()
            if change >= least_edge and not (is_surface and not soft[x + EDGE_WINDOW_PX // 2]):
                total.append(change)
                left.append(np.fmax(change - steps.max(), 0))
    return sum(left) / sum(total) if total else 0.0


@pytest.mark.parametrize("shape", [(23, 31), (9, 8), (8, 9), (8, 8)])
@pytest.mark.parametrize("unknown", [0.0, 0.02])
def test_softness_against_a_slow_twin(shape: tuple[int, int], unknown: float):
    disparity = np.cumsum(random_disparity(np.random.default_rng(4), shape, 0.0), axis=1)
    disparity[np.random.default_rng(5).random(shape) < unknown] = np.nan
    assert find_soft_edges(disparity, 1.5)[1] == pytest.approx(slow_softness(disparity, 1.5), rel=1e-5)


@pytest.mark.parametrize("unknown", [0.0, 0.02])
def test_soft_edges_against_a_slow_twin(unknown: float):
    random = np.random.default_rng(6)
    layers = np.repeat(np.repeat(random.normal(size=(4, 5)), 17, axis=0), 13, axis=1)
    disparity = (3 * blur(layers.astype(np.float32), 1.5)).astype(np.float32)
    disparity[random.random(disparity.shape) < unknown] = np.nan
    soft = find_soft_edges(disparity, 1.5)[0]
    along_rows = np.array([slow_soft(row, 1.5) for row in disparity])
    along_columns = np.array([slow_soft(column, 1.5) for column in disparity.T]).T
    assert (soft == along_rows | along_columns).all()
    assert 0.1 < soft.mean() < 0.95


@pytest.mark.parametrize("slope", [0.05, 0.3, 0.9])
def test_slopes_that_go_on_are_surfaces_and_no_soft_edges(slope: float):
    y, x = np.mgrid[:80, :120].astype(np.float32)
    plane, relief = slope * (x - y), slope * 64 / (2 * np.pi) * np.cos(x * 2 * np.pi / 64)
    for surface in (plane, relief.astype(np.float32)):
        soft, softness = find_soft_edges(surface, 0.25)
        assert not soft.any()
        assert softness == 0


def test_soft_edges_are_marked_where_they_are():
    """A map that is soft on one side and sharp on the other, before a slanted wall."""
    disparity = square(64) + np.float32(0.02) * np.arange(64, dtype=np.float32)
    disparity[:, :32] = blur(disparity, 2)[:, :32]
    soft, softness = find_soft_edges(disparity, 0.5)
    assert soft[24:40, 12:20].all()
    assert not soft[24:40, 32:].any()
    assert 0.1 < softness < find_soft_edges(blur(disparity, 2), 0.5)[1]


def test_softness_tells_steps_from_slopes():
    assert find_soft_edges(square(), 0.5)[1] == 0
    softness = [find_soft_edges(blur(square(), sigma), 0.5)[1] for sigma in (0.5, 1, 2, 4)]
    assert softness == sorted(softness)
    assert softness[-1] > 0.8 > 0.5 > softness[0] > 0


@pytest.mark.parametrize(
    "disparity",
    [
        np.zeros((40, 40)),
        np.full((40, 40), np.nan),
        np.full((40, 40), np.inf),
        np.zeros((1, 1)),
        np.full((40, 40), 1e30),
        np.tile(np.linspace(0, 1e-3, 40), (40, 1)),
    ],
)
def test_maps_without_depth_edges_have_softness_0(disparity: np.ndarray):
    assert find_soft_edges(disparity.astype(np.float32), 0.5)[1] == 0
