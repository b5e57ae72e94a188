"""Tone of a disparity map: against a slow twin, monotone, finite whatever the map holds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.depth.editing.edits import (
    HISTOGRAM_BINS,
    UNEDITED,
    DepthEdits,
    Stroke,
    apply_tone,
    extent_of,
    levels_of,
    require_sound,
)
from iibr_core.types import InputError

shares = st.floats(0, 1)
tones = st.builds(
    lambda inverted, clips, gamma: DepthEdits(inverted, min(clips), max(clips), gamma),
    st.booleans(),
    st.just((0.0, 1.0)) | st.tuples(shares, shares),
    st.floats(0.25, 4),
)


def slow_toned(value: float, low: float, high: float, edits: DepthEdits) -> float:
    share = (value - low) / (high - low)
    if edits.is_inverted:
        share = 1 - share
    if edits.far_clip > 0:
        share = max(share, edits.far_clip)
    if edits.near_clip < 1:
        share = min(share, edits.near_clip)
    if 0 <= share <= 1:
        share = share**edits.gamma
    elif share > 1:
        share = 1 + edits.gamma * (share - 1)
    return low + share * (high - low)


@given(tones, st.integers(0, 1000))
def test_tone_is_its_slow_twin_at_every_pixel(edits: DepthEdits, seed: int) -> None:
    disparity = np.random.default_rng(seed).normal(0, 3, (7, 9)).astype(np.float32)
    low, high = extent_of(disparity)
    wanted = [slow_toned(float(value), low, high, edits) for value in disparity.flat]
    np.testing.assert_allclose(apply_tone(disparity, edits).flat, wanted, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("edits", [UNEDITED, DepthEdits(True, 0.2, 0.8, 2.0), DepthEdits(gamma=0.25)])
@pytest.mark.parametrize(
    "values",
    [[np.nan, 1, 2], [np.inf, -np.inf, 1], [3e38, -3e38, 0], [1e-40, 2e-40, 0], [5, 5, 5], [0, 0, 1e6], [7]],
    ids=str,
)
def test_hard_maps_stay_finite(values: list[float], edits: DepthEdits) -> None:
    result = apply_tone(np.array([values], np.float32), edits)
    assert result.shape == (1, len(values))
    assert np.isfinite(result).all()


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (2, 3)])
def test_a_map_that_knows_nothing_is_an_error(shape: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="no disparity is known"):
        extent_of(np.full(shape, np.nan, np.float32))


def test_the_extent_leaves_wild_values_out_and_a_flat_map_has_one_too() -> None:
    disparity = np.random.default_rng(0).uniform(-1, 1, (100, 100)).astype(np.float32)
    disparity[3, 3] = 1e6
    low, high = extent_of(disparity)
    assert -1 <= low < high <= 1
    low, high = extent_of(np.full((10, 200), 3.0, np.float32))
    assert (low, high) == (2.0, 4.0)


def test_levels_count_every_pixel_once() -> None:
    disparity = np.random.default_rng(0).normal(size=(40, 50)).astype(np.float32)
    disparity[0, :3] = np.nan
    levels = levels_of(disparity)
    assert len(levels.counts) == HISTOGRAM_BINS
    assert sum(levels.counts) == 40 * 50 - 3
    inside = np.mean((disparity > levels.low) & (disparity < (levels.low + levels.high) / 2))
    assert sum(levels.counts[: HISTOGRAM_BINS // 2]) / sum(levels.counts) == pytest.approx(inside, abs=0.01)


@pytest.mark.parametrize(
    "edits",
    [
        DepthEdits(gamma=np.nan),
        DepthEdits(far_clip=0.6, near_clip=0.5),
        DepthEdits(strokes=(Stroke("nearer", (), 0.1, 0.5),)),
        DepthEdits(strokes=(Stroke("carve", ((0.5, 0.5),), 0.1, 0.5),)),  # type: ignore[arg-type]
        DepthEdits(strokes=(Stroke("nearer", ((0.5, np.inf),), 0.1, 0.5),)),
    ],
)
def test_edits_that_make_no_sense_are_refused(edits: DepthEdits) -> None:
    with pytest.raises(InputError, match="depth edits"):
        require_sound(edits)
