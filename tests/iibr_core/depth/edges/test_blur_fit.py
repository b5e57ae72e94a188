"""Sharpened maps fitted to the blur that they come from: against slow twins, and what must stay as it is."""

from __future__ import annotations

import numpy as np
import pytest
from iibr_core.depth.edges.blur_fit import fit_to_blur

from iibr_core.depth.edges import blur_fit
from iibr_core.runtime import tiling
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.training.degradation import blur
from tests.iibr_core.scenes import smooth_texture

SIZE = (96, 128)
SIGMA = 2.0
WEIGHT = 0.4
LEAST_EDGE = 0.06


def disc() -> tuple[np.ndarray, np.ndarray]:
    """Photo and exact disparity of a disc before a slanted wall, both textured alike but for their tint."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    is_disc = np.hypot(x - 60, y - 45) < 24
    photo = np.where(is_disc[..., None], smooth_texture(*SIZE, 3) * [1, 0.7, 0.5], smooth_texture(*SIZE, 4) * 0.6)
    return photo.astype(np.float32), np.where(is_disc, 2.0, 0.2 + 0.002 * x).astype(np.float32)


def ragged(exact: np.ndarray) -> np.ndarray:
    """The map with an outline that is wrong by a pixel, here and there."""
    rng = np.random.default_rng(5)
    dy, dx = (np.rint(blur(rng.normal(size=SIZE).astype(np.float32), 1.0) * 4).clip(-1, 1).astype(int) for _ in "yx")
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    is_disc = exact[np.clip(y + dy, 0, SIZE[0] - 1), np.clip(x + dx, 0, SIZE[1] - 1)] > 1.2
    return np.where(is_disc, 2.0, 0.2 + 0.002 * x).astype(np.float32)


def wrong_side(fitted: np.ndarray, exact: np.ndarray) -> int:
    return int(np.count_nonzero((fitted > 1.2) != (exact > 1.2)))


def fit(photo: np.ndarray, values: np.ndarray, sharp: np.ndarray) -> np.ndarray:
    return fit_to_blur(photo, values, sharp, SIGMA, LEAST_EDGE)


def test_ragged_outlines_become_whole() -> None:
    photo, exact = disc()
    start = ragged(exact)
    fitted = fit(photo, blur(exact, SIGMA), start)
    assert wrong_side(start, exact) > 80
    assert wrong_side(fitted, exact) < 0.1 * wrong_side(start, exact)


def test_edges_of_a_narrow_blur_stay_where_the_map_has_them() -> None:
    """Pixels just inside the disc have the wall's colours, as mixed ones nearly do."""
    photo, exact = disc()
    photo[exact > 1.2], photo[exact < 1.2] = [0.8, 0.2, 0.1], [0.1, 0.3, 0.7]
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    photo[(exact > 1.2) & (np.hypot(x - 60, y - 45) > 23)] = photo[5, 5]
    narrow, wide = (fit_to_blur(photo, blur(exact, sigma), exact, sigma, LEAST_EDGE) for sigma in (0.8, 3.0))
    assert wrong_side(narrow, exact) < 10
    assert wrong_side(wide, exact) > 30


def test_what_was_not_sharpened_stays_as_long_as_nothing_moves_beside_it() -> None:
    photo, exact = disc()
    soft, start = blur(exact, SIGMA), ragged(exact)
    np.testing.assert_array_equal(fit(photo, start, start), start)
    # The left half is exact.
    soft[:, :60] = start[:, :60]
    fitted = fit(photo, soft, start)
    np.testing.assert_array_equal(fitted[:, :48], start[:, :48])
    assert not np.array_equal(fitted[:, 66:], start[:, 66:])


def test_wide_blurs_are_left_alone() -> None:
    photo, exact = disc()
    start = ragged(exact)
    assert fit_to_blur(photo, blur(exact, 5.0), start, 1.1 * blur_fit.WIDEST_FITTED_SIGMA_PX, LEAST_EDGE) is start


def test_bands_and_threads_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    photo, exact = disc()
    soft, start = blur(exact, SIGMA), ragged(exact)
    once = fit(photo, soft, start)
    monkeypatch.setattr(tiling, "MOST_BAND_PIXELS", 700)
    monkeypatch.setattr(tiling, "THREADS", 3)
    np.testing.assert_array_equal(fit(photo, soft, start), once)


def test_it_can_be_cancelled() -> None:
    photo, exact = disc()
    answers = iter([False] * 3)
    with pytest.raises(Cancelled), stoppable(lambda: next(answers, True)):
        fit_to_blur(photo, blur(exact, SIGMA), ragged(exact), SIGMA, LEAST_EDGE)


def full_taps() -> np.ndarray:
    """(R, R): the blur's whole kernel."""
    apart = np.abs(np.arange(-6, 7))
    line = np.exp(-0.5 * (apart / SIGMA) ** 2)
    return np.outer(line, line) / line.sum() ** 2


def window(image: np.ndarray, y: int, x: int) -> np.ndarray:
    """13 x 13 pixels, the border's going on."""
    return np.pad(image, 6, mode="edge")[y : y + 13, x : x + 13]


def test_what_is_missing_against_a_blur_pixel_by_pixel() -> None:
    _, exact = disc()
    values, missing = np.zeros(SIZE, np.float32), np.empty(SIZE, np.float32)
    blur_fit._find_missing(values, exact, blur_fit._taps(SIGMA), 0, SIZE[0], missing)
    for y, x in [(0, 0), (45, 35), (45, 83), (95, 127), (31, 64), (20, 60)]:
        assert -missing[y, x] == pytest.approx((window(exact, y, x) * full_taps()).sum(), abs=1e-5)


def test_edges_move_where_the_misfit_falls() -> None:
    """Every move, with colours that tell nothing, lowers what a blur of the whole map says of misfit and outline."""
    _, exact = disc()
    photo, fitted = np.full((*SIZE, 3), 0.5, np.float32), ragged(exact)
    soft = blur(exact, SIGMA)
    missing = np.zeros(SIZE, np.float32)
    blur_fit._find_missing(soft, fitted, blur_fit._taps(SIGMA), 0, SIZE[0], missing)
    for y in range(25, 40):
        before, left = fitted.copy(), missing.copy()
        blur_fit._move_edges(
            photo, fitted, missing, blur_fit._taps(SIGMA), 1.0, LEAST_EDGE, y, y + 1, np.zeros(SIZE, np.bool_)
        )
        blurred_again = np.zeros(SIZE, np.float32)
        blur_fit._find_missing(soft, fitted, blur_fit._taps(SIGMA), 0, SIZE[0], blurred_again)
        np.testing.assert_allclose(missing, blurred_again, atol=1e-4)
        unlike = [np.count_nonzero(np.abs(np.diff(m, axis=axis)) > 0.5) for m in (before, fitted) for axis in (0, 1)]
        assert np.sum(missing**2) <= np.sum(left**2) or sum(unlike[2:]) < sum(unlike[:2])
    assert wrong_side(fitted[25:40], exact[25:40]) < wrong_side(ragged(exact)[25:40], exact[25:40])


def test_what_is_missing_is_known_up_to_the_frame_after_moves() -> None:
    """An outline two pixels from all four sides of a map: what moves there counts at the frame, too."""
    frame = np.s_[19:72, 34:87]
    exact, fitted = (np.ascontiguousarray(values[frame]) for values in (disc()[1], ragged(disc()[1])))
    photo, taps, height = np.full((*exact.shape, 3), 0.5, np.float32), blur_fit._taps(SIGMA), len(exact)
    soft, start = blur(exact, SIGMA), fitted.copy()
    missing, again = np.empty_like(exact), np.empty_like(exact)
    blur_fit._find_missing(soft, fitted, taps, 0, height, missing)
    blur_fit._move_edges(photo, fitted, missing, taps, 1.0, LEAST_EDGE, 0, height, np.zeros(exact.shape, np.bool_))
    blur_fit._find_missing(soft, fitted, taps, 0, height, again)
    np.testing.assert_allclose(missing, again, atol=1e-4)
    moved = np.argwhere(fitted != start)
    assert (moved.min(axis=0) < 5).all()
    assert (moved.max(axis=0) > np.array(exact.shape) - 6).all()


def slow_vote(photo: np.ndarray, fitted: np.ndarray, y: int, x: int, here: float, there: float) -> float:
    """Mean colours of clean pixels of both heights, by 1 / squared distance; how far on the way between them."""
    near = max(0.5 * abs(there - here), LEAST_EDGE)
    found: tuple[list, list] = ([], [])
    reach = range(-blur_fit.COLOR_PX, blur_fit.COLOR_PX + 1)
    for v, u in ((y + j, x + i) for j in reach for i in reach):
        if (v - y) ** 2 + (u - x) ** 2 <= 2 or not (1 <= v <= SIZE[0] - 2 and 1 <= u <= SIZE[1] - 2):
            continue
        is_clean = all(abs(fitted[v + j, u + i] - fitted[v, u]) < near for j, i in ((1, 0), (-1, 0), (0, 1), (0, -1)))
        apart = abs(fitted[v, u] - here), abs(fitted[v, u] - there)
        if is_clean and min(apart) < near:
            found[0 if apart[0] < near else 1].append((1 / ((v - y) ** 2 + (u - x) ** 2), photo[v, u]))
    if not all(found):
        return 0.0
    own, other = (np.average([color for _, color in side], 0, [weight for weight, _ in side]) for side in found)
    way, color = other - own, photo[y, x] - own
    share = color @ way / (way @ way)
    rest = max(color @ color - share * (color @ way), 0)
    return 2 * (np.clip(share, 0, 1) - 0.5) * (way @ way) / (way @ way + rest + blur_fit.COLOR_NOISE)


def test_votes_and_moves_are_those_of_the_definition() -> None:
    """Each pixel alone: of its four neighbours' heights the one that lowers misfit, outline and colours most."""
    photo, exact = disc()
    photo = (photo + np.random.default_rng(0).normal(0, 0.1, photo.shape)).astype(np.float32)
    start, soft, moved = ragged(exact), blur(exact, SIGMA), 0
    start[:5, :9] = 2.0  # a corner of the map
    missing = np.empty(SIZE, np.float32)
    blur_fit._find_missing(soft, start, blur_fit._taps(SIGMA), 0, SIZE[0], missing)
    padded = np.pad(missing, 6)
    beside = [(y, x) for y in range(1, 95) for x in range(1, 127) if np.ptp(start[y - 1 : y + 2, x]) > LEAST_EDGE]
    for y, x in beside[::11]:
        here, sums = start[y, x], np.empty((2, 4))
        wanted = (padded[y : y + 13, x : x + 13] * full_taps()).sum()
        best, expected = 0.0, here
        for v, u in ((y + 1, x), (y - 1, x), (y, x + 1), (y, x - 1)):
            there = start[v, u]
            if abs(there - here) < LEAST_EDGE:
                continue
            vote = blur_fit._color_vote(photo, start, y, x, here, there, LEAST_EDGE, sums)
            assert vote == pytest.approx(slow_vote(photo, start, y, x, here, there), abs=1e-4)
            around, near = start[y - 1 : y + 2, x - 1 : x + 2], abs(there - here) / 2
            neighbours = np.count_nonzero(abs(around - here) < near) - np.count_nonzero(abs(around - there) < near) - 1
            assert blur_fit._same_surface_neighbours(start, y, x, here, there) == neighbours
            change = 1 - 2 * wanted / ((there - here) * (full_taps() ** 2).sum())
            change += WEIGHT * (neighbours - blur_fit.COLOR_WEIGHT * vote)
            if change < best:
                best, expected = change, there
        fitted, settled = start.copy(), np.ones(SIZE, np.bool_)
        settled[y, x] = False
        blur_fit._move_edges(
            photo, fitted, missing.copy(), blur_fit._taps(SIGMA), WEIGHT, LEAST_EDGE, y, y + 1, settled
        )
        assert fitted[y, x] == expected
        moved += expected != here
    assert moved > 5


def test_colours_of_clean_pixels_on_both_sides_vote() -> None:
    photo, exact = disc()
    photo[exact > 1.2], photo[exact < 1.2] = [0.8, 0.2, 0.1], [0.1, 0.3, 0.7]
    on_edge = [(45, 37), (45, 36), (45, 82), (45, 84)]
    for y, x in on_edge:
        here, there = (2.0, 0.3) if exact[y, x] > 1.2 else (exact[y, x], 2.0)
        assert blur_fit._color_vote(photo, exact, y, x, here, there, LEAST_EDGE, np.empty((2, 4))) < -0.9
        photo[y, x] = photo[5, 5] if exact[y, x] > 1.2 else photo[45, 60]
        assert blur_fit._color_vote(photo, exact, y, x, here, there, LEAST_EDGE, np.empty((2, 4))) > 0.9
        # Half of both tells nothing.
        photo[y, x] = 0.5 * (photo[5, 5] + photo[45, 60])
        assert abs(blur_fit._color_vote(photo, exact, y, x, here, there, LEAST_EDGE, np.empty((2, 4)))) < 0.1
