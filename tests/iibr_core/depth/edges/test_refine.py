"""Soft depth edges made sharp: against the exact maps they came from, and the cases that must stay as they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from iibr_core.depth.edges.refine import refine
from iibr_core.training.degradation import blur
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import ImageSize, InputError, ViewOffset
from tests.iibr_core.scenes import smooth_texture

CENTRE = ViewOffset(0.0, 0.0)


def disc_before_slope(size: int = 120) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Photo, exact disparity, foreground: a tilted disc before a tilted wall."""
    y, x = np.mgrid[:size, :size] * (120 / size)
    foreground = (x - 55) ** 2 + (y - 62) ** 2 < 32**2
    front, wall = smooth_texture(size, size, 1) * [1, 0.6, 0.3], smooth_texture(size, size) * 0.4
    photo = np.where(foreground[..., None], front, wall)
    disparity = np.where(foreground, 2.0 + 0.002 * x, 0.3 + 0.003 * y)
    return photo.astype(np.float32), disparity.astype(np.float32), foreground


def rms(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)))


@pytest.mark.parametrize(("sigma", "share"), [(1.0, 0.35), (4.0, 0.5)])
def test_blurred_edges_become_steps_where_they_were(sigma: float, share: float) -> None:
    photo, disparity, foreground = disc_before_slope()
    soft = blur(disparity, sigma)
    sharp = refine(photo, soft)
    assert rms(sharp, disparity) < share * rms(soft, disparity)
    assert np.mean((sharp > 1.2) != foreground) < 0.01
    y, x = np.mgrid[:120, :120]
    far_from_edge = np.abs(np.hypot(x - 55, y - 62) - 32) > 7 * sigma
    np.testing.assert_array_equal(sharp[far_from_edge], soft[far_from_edge], "slants stay")
    flying = (sharp > 0.9) & (sharp < 1.7)
    assert flying.mean() < 0.05 * ((soft > 0.9) & (soft < 1.7)).mean()


def test_the_edge_follows_the_photo_where_the_map_is_beside_it() -> None:
    photo, disparity, foreground = disc_before_slope()
    soft = blur(np.roll(disparity, 1, axis=1), 1.5)
    without_photo = refine(np.full_like(photo, 0.5), soft)
    wrong, wrong_without = ((sharp > 1.2) != foreground for sharp in (refine(photo, soft), without_photo))
    assert wrong.sum() < 0.7 * wrong_without.sum()


@pytest.mark.parametrize("seed", range(2))
def test_exact_maps_stay_as_they_are(seed: int) -> None:
    colors, disparity = render(
        random_scene(np.random.default_rng(seed), ImageSize(128, 160), 3.0), ImageSize(128, 160), CENTRE, 1
    )
    np.testing.assert_array_equal(refine(colors, disparity), disparity)


@settings(max_examples=15)
@given(
    hnp.arrays(
        np.float32,
        st.tuples(st.integers(2, 24), st.integers(2, 24)),
        elements=st.floats(-1e6, 1e6, width=32) | st.sampled_from([np.nan, np.inf, 1.0, 0.0]),
    )
)
def test_any_map_comes_back_finite(disparity: np.ndarray) -> None:
    photo = np.random.default_rng(0).random((*disparity.shape, 3), dtype=np.float32)
    if not np.isfinite(disparity).any():
        with pytest.raises(InputError, match="no disparity is known"):
            refine(photo, disparity)
    else:
        assert np.isfinite(refine(photo, disparity)).all()


@pytest.mark.parametrize("sigma", [1.0, 2.0])
def test_flat_fronts_stay_flat_and_round_ones_round(sigma: float) -> None:
    """A ball falls away from the view at its outline: that is not what the blur took."""
    y, x = np.mgrid[:96, :128]
    away = np.hypot(x - 64, y - 48)
    inside = away < 30
    photo = np.where(inside[..., None], [0.8, 0.3, 0.2], [0.2, 0.3, 0.7]).astype(np.float32)
    for front, limit in ((np.full_like(away, 2.0), 0.05), (1.5 + np.sqrt(np.maximum(900 - away**2, 0)) / 60, 0.02)):
        exact = np.where(inside, front, 0).astype(np.float32)
        refined = refine(photo, blur(exact, sigma))
        assert np.mean((refined > 1) == inside) > 0.999
        assert rms(refined[inside], exact[inside]) < 0.03
        assert abs((refined - exact)[inside & (away > 25)].mean()) < limit
