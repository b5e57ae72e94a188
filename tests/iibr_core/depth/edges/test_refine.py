import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import gaussian_filter, maximum_filter

from iibr_core.depth.edges.refine import refine
from iibr_core.method.flying_pixels import measure_detail
from iibr_core.method.mixed_pixels import split_mixed_pixels
from iibr_core.training.degradation import blur, coarsen, quantise
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import CENTRE, ImageSize, InputError
from tests.iibr_core.scenes import smooth_texture


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


@pytest.mark.parametrize("seed", range(2))
def test_exact_maps_stay_as_they_are(seed) -> None:
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
def test_any_map_comes_back_finite(disparity) -> None:
    photo = np.random.default_rng(0).random((*disparity.shape, 3), dtype=np.float32)
    if not np.isfinite(disparity).any():
        with pytest.raises(InputError, match="no disparity is known"):
            refine(photo, disparity)
    else:
        assert np.isfinite(refine(photo, disparity)).all()


@pytest.mark.parametrize("sigma", [1.0, 2.0])
def test_flat_fronts_stay_flat_and_round_ones_round(sigma) -> None:
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


HEIGHT, WIDTH = 96, 128
Y, X = np.mgrid[:HEIGHT, :WIDTH] - np.array([HEIGHT / 2, WIDTH / 2])[:, None, None]


def patches() -> np.ndarray:
    rng = np.random.default_rng(11)
    points, colors = (rng.random((40, 2)) - 0.5) * [HEIGHT, WIDTH], rng.random((40, 3))
    nearest = ((Y[..., None] - points[:, 0]) ** 2 + (X[..., None] - points[:, 1]) ** 2).argmin(-1)
    return colors[nearest].astype(np.float32)


def hills(width: float) -> np.ndarray:
    values = blur(np.random.default_rng(3).random((HEIGHT, WIDTH), np.float32), width)
    return 2 * (values - values.mean()) / values.std()


PHOTOS = smooth_texture(HEIGHT, WIDTH), patches()
SURFACES = {
    "steep plane": -0.9 * X,
    "plane": 0.3 * X + 0.05 * Y,
    "fine relief": 0.2 * 12 / 6 * np.cos(2 * np.pi * (X + 0.6 * Y) / 12),
    "wide relief": 0.5 * 64 / 6 * np.cos(2 * np.pi * X / 64),
    "bump": 3 * np.exp(-(X**2 + Y**2) / (2 * 15**2)),
    "cushion": 4 * (1 - np.clip(np.abs(X) / 38, 0, 1) ** 4) * (1 - np.clip(np.abs(Y) / 38, 0, 1) ** 4),
    "hills": hills(12),
    "rounded step": 3 * np.tanh((X + 0.3 * Y) / 8),  # as flat on both sides as a blurred step: only the photo tells
}


@pytest.mark.parametrize("surface", SURFACES)
def test_smooth_surfaces_stay_as_they_are_and_coarse_levels_make_no_stairs_of_them(surface) -> None:
    smooth = SURFACES[surface].astype(np.float32)
    levels = [quantise(smooth, float(np.ptp(smooth)) / count) for count in (255, 24)]
    for photo in PHOTOS:
        for disparity in (smooth, *(() if surface == "rounded step" else (*levels, coarsen(levels[0], 2)))):
            np.testing.assert_array_equal(refine(photo, disparity), disparity)


@pytest.mark.parametrize("sigma", [1.0, 4.0])
def test_only_the_soft_side_of_a_map_is_refined(sigma) -> None:
    """Discs from left to right: the left ones exact, the right ones blurred."""
    y, x = np.mgrid[:200, :400]
    rng, exact = np.random.default_rng(3), np.zeros((200, 400), np.float32)
    photo = 0.4 * np.tile(smooth_texture(200, 100), (1, 4, 1))
    for at in np.arange(20, 400, 40):
        disc = np.hypot(x - at, y - rng.uniform(40, 160)) < rng.uniform(12, 30)
        exact[disc], photo[disc] = rng.uniform(1, 4), 0.3 * photo[disc] + 0.6 * rng.random(3)
    share = np.clip((np.arange(400) - 190) / 20, 0, 1)
    given = ((1 - share) * exact + share * blur(exact, sigma)).astype(np.float32)
    refined = refine(photo.astype(np.float32), given)
    np.testing.assert_array_equal(refined[:, :184], given[:, :184])
    soft = (slice(None), slice(216, None))
    assert np.abs(refined - exact)[soft].mean() < 0.5 * np.abs(given - exact)[soft].mean()


ROWS, COLUMNS, SIGMA, EDGE = 44, 60, 1.5, 0.3
HEIGHTS = np.float32([0, 2, 1.25, 3, 2.5])
TURNS = {
    "left and right": lambda values: values[:, ::-1],
    "up and down": lambda values: values[::-1],
    "rows and columns": lambda values: values.swapaxes(0, 1),
}


def things():
    """Return the thing that each pixel of a map shows: a wall, a box, a disc and two wires, one of them aslant."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    thing = np.zeros((ROWS, COLUMNS), int)
    thing[8:20, 6:24] = 1
    thing[(y - 30) ** 2 + (x - 42) ** 2 < 81] = 2
    thing[:, 30:33], thing[abs(x - y - 8) < 2] = 3, 4
    return thing


def scene():
    """Return a photo (H, W, 3) of these and their map (H, W), on slants, blurred."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    thing = things()
    heights = HEIGHTS[thing] + 0.004 * x - 0.006 * y
    colors = np.float32([(0.2, 0.3, 0.5), (0.8, 0.4, 0.2), (0.3, 0.7, 0.3), (0.9, 0.9, 0.2), (0.6, 0.1, 0.6)])[thing]
    photo = colors + np.random.default_rng(1).normal(0, 0.02, colors.shape)
    return photo.astype(np.float32), gaussian_filter(heights, SIGMA, mode="nearest").astype(np.float32)


def faulty_maps():
    return scene()[1], maximum_filter(HEIGHTS[things()], 3)


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_a_turned_map_is_refined_alike(turn):
    """Ties may differ."""
    photo = scene()[0]
    for worse in faulty_maps():
        expected = turn(refine(photo, worse))
        found = refine(np.ascontiguousarray(turn(photo)), np.ascontiguousarray(turn(worse)))
        assert (abs(found - expected) > 0.05).mean() < 0.02
        assert (abs(expected - turn(worse)) > 0.05).mean() > 0.02, "something is refined"


def grey_in_one_channel(photo, channel):
    shown = np.full_like(photo, 0.5)
    shown[..., channel] = photo.mean(axis=2)
    return shown


@pytest.mark.parametrize("channel", [1, 2])
def test_all_channels_count_alike(channel):
    photo = scene()[0] + 0.1 * smooth_texture(ROWS, COLUMNS)
    first, other = grey_in_one_channel(photo, 0), grey_in_one_channel(photo, channel)
    for worse in faulty_maps():
        expected = refine(first, worse)
        np.testing.assert_allclose(refine(other, worse), expected, atol=1e-5)
        assert (expected != worse).any()
    torn = np.ones(other.shape[:2], np.bool_)
    np.testing.assert_array_equal(measure_detail(other, torn), measure_detail(first, torn))
    exact = HEIGHTS[things()]
    split, expected = split_mixed_pixels(other, exact, EDGE), split_mixed_pixels(first, exact, EDGE)
    np.testing.assert_allclose(split[3], expected[3], atol=1e-5)
    np.testing.assert_allclose(split[0][..., channel], expected[0][..., 0], atol=1e-5)
    assert (expected[3] > 0).sum() > 50
