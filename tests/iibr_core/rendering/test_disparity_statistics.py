import numpy as np
import pytest

from iibr_core.rendering.disparity_statistics import (
    AROUND_PX,
    EDGE_WINDOW_PX,
    STEP_AROUND_PX,
    edge_softness,
    measure_disparity,
)
from iibr_core.training.degradation import blur


def slow_surroundings(disparity: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixel by pixel, as the docstring says."""
    height, width = disparity.shape
    low, high, step = (np.zeros_like(disparity) for _ in range(3))
    for y in range(height):
        for x in range(width):
            near = disparity[max(y - AROUND_PX, 0) : y + AROUND_PX + 1, max(x - AROUND_PX, 0) : x + AROUND_PX + 1]
            if np.isfinite(near).any():
                low[y, x], high[y, x] = np.nanmin(near), np.nanmax(near)
            wide = disparity[
                max(y - STEP_AROUND_PX, 0) : y + STEP_AROUND_PX + 1, max(x - STEP_AROUND_PX, 0) : x + STEP_AROUND_PX + 1
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


def slow_softness(disparity: np.ndarray, least_edge: float) -> float:
    left, total = [], []
    for values in (*disparity, *disparity.T):
        for x in range(len(values) - EDGE_WINDOW_PX):
            steps = np.abs(np.diff(values[x : x + EDGE_WINDOW_PX + 1]))
            change = abs(values[x + EDGE_WINDOW_PX] - values[x])
            if change >= least_edge:
                total.append(change)
                left.append(np.fmax(change - steps.max(), 0))
    return sum(left) / sum(total) if total else 0.0


@pytest.mark.parametrize("shape", [(23, 31), (9, 8), (8, 9), (8, 8)])
@pytest.mark.parametrize("unknown", [0.0, 0.02])
def test_softness_against_a_slow_twin(shape: tuple[int, int], unknown: float):
    disparity = np.cumsum(random_disparity(np.random.default_rng(4), shape, 0.0), axis=1)
    disparity[np.random.default_rng(5).random(shape) < unknown] = np.nan
    assert edge_softness(disparity, 1.5) == pytest.approx(slow_softness(disparity, 1.5), rel=1e-5)


def test_softness_tells_steps_from_slopes():
    assert edge_softness(square(), 0.5) == 0
    softness = [edge_softness(blur(square(), sigma), 0.5) for sigma in (0.5, 1, 2, 4)]
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
    assert edge_softness(disparity.astype(np.float32), 0.5) == 0
