"""The bokeh table: the plain blurs against slow twins, the traced lens against a sum of views, and a small report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import hypot

import numpy as np
import pytest

from benchmarks.tables.bokeh import OURS, SHARP, TRUE, LensCamera, draw_shot, judge, maps_of, report_parts, trace_lens
from benchmarks.tables.lens_blurs import circle_radius, gather, scatter
from benchmarks.thin_lens import ThinLens
from iibr_core.evaluation.metrics import psnr
from iibr_core.evaluation.refocus import FocalStack, Focus, within
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import FloatImage, ImageSize, ViewOffset
from viewer.gpu.context import GLContext

Blur = Callable[[FloatImage, FloatImage, ThinLens], FloatImage]
SMALL = ImageSize(48, 64)
SEED = 9100
LENS = ThinLens(focus_disparity=0.3, radius_views=2.0)


def small_photo(seed: int) -> tuple[FloatImage, FloatImage]:
    """Colours and disparity of no sense, with steps."""
    rng = np.random.default_rng(seed)
    disparity = rng.choice(np.array([-0.4, 0.3, 0.5, 1.4], np.float32), (9, 11))
    return rng.random((9, 11, 3), np.float32), disparity


def disc(radius: float, at: tuple[int, int], shape: tuple[int, ...]) -> FloatImage:
    """(H, W): how much of each pixel lies in a circle around one of them, about."""
    share = np.zeros(shape, np.float32)
    for y, x in np.ndindex(*shape):
        share[y, x] = min(max(radius + 0.5 - hypot(y - at[0], x - at[1]), 0), 1)
    share[at] = 1
    return share


def slow_scatter(linear: FloatImage, disparity: FloatImage, lens: ThinLens) -> FloatImage:
    radius, room = circle_radius(disparity, lens), 8
    layers = np.floor((disparity - disparity.min()) * lens.radius_views)
    total = np.zeros((*disparity.shape, 4))
    for layer in np.unique(layers):
        spread = np.zeros_like(total)
        for y, x in np.argwhere(layers == layer):
            # With room around, so that what leaves the frame is lost.
            share = disc(radius[y, x], (y + room, x + room), tuple(n + 2 * room for n in disparity.shape))
            share = (share / share.sum())[room:-room, room:-room]
            spread += share[..., None] * np.append(linear[y, x], 1)
        cover = spread[..., 3:]
        total = spread / np.maximum(cover, 1) + total * np.maximum(1 - cover, 0)
    return np.asarray(total[..., :3] / total[..., 3:], np.float32)


def slow_gather(linear: FloatImage, disparity: FloatImage, lens: ThinLens) -> FloatImage:
    radius, result = circle_radius(disparity, lens), np.empty_like(linear)
    for at in np.ndindex(*disparity.shape):
        own = disc(radius[at], at, disparity.shape)
        theirs = np.array([disc(radius[q], q, disparity.shape)[at] for q in np.ndindex(*disparity.shape)])
        share = np.minimum(own, theirs.reshape(disparity.shape))
        result[at] = np.tensordot(share, linear, 2) / share.sum()
    return result


@pytest.mark.parametrize(("blur", "slow"), [(scatter, slow_scatter), (gather, slow_gather)])
def test_a_blur_is_its_slow_twin(blur: Blur, slow: Blur) -> None:
    for seed in range(3):
        linear, disparity = small_photo(seed)
        np.testing.assert_allclose(blur(linear, disparity, LENS), slow(linear, disparity, LENS), atol=1e-5)


@pytest.mark.parametrize("blur", [scatter, gather])
def test_what_is_in_focus_and_what_has_one_colour_stay(blur: Blur) -> None:
    linear, disparity = small_photo(0)
    np.testing.assert_array_equal(blur(linear, np.full_like(disparity, 0.3), LENS), linear)
    grey = np.full_like(linear, 0.25)
    np.testing.assert_allclose(blur(grey, disparity, LENS), grey, rtol=1e-5)


def test_the_traced_lens_sees_the_sum_of_the_views() -> None:
    """Of the independent summation that evaluation has, a quarter step apart; a radius 10 % off costs 3 dB."""
    size, quarter = ImageSize(64, 80), 0.25
    scene = random_scene(np.random.default_rng(SEED), size, 2.0)
    lens = ThinLens(focus_disparity=0.4, radius_views=3.0)
    focus = Focus("in quarter steps", lens.focus_disparity * quarter, lens.radius_views / quarter)
    stack = FocalStack([focus])
    for t, s in np.ndindex(25, 25):
        at = ViewOffset(t - 12.0, s - 12.0)
        stack.add(at, render(scene, size, ViewOffset(at.t * quarter, at.s * quarter))[0])
    traced = trace_lens(scene, size, lens, rays=256)
    assert psnr(within(traced, focus), stack.pictures()[0]) > 55


def test_a_pinhole_sees_the_photo() -> None:
    scene = random_scene(np.random.default_rng(SEED), SMALL, 2.0)
    photo, _ = render(scene, SMALL, ViewOffset(0, 0), samples=8)
    assert psnr(trace_lens(scene, SMALL, ThinLens(0.5, 0.0), rays=64), photo) > 40


def test_wrong_maps_are_wrong_and_keep_the_true_one() -> None:
    photo, disparity = render(random_scene(np.random.default_rng(SEED), SMALL, 2.0), SMALL, ViewOffset(0, 0))
    maps = maps_of(photo, disparity, np.random.default_rng(0))
    np.testing.assert_array_equal(maps.pop(TRUE), disparity)
    for wrong in maps.values():
        assert wrong.shape == disparity.shape
        assert np.abs(wrong - disparity).max() > 0.1


def test_a_small_report_has_a_row_for_every_method(gl: GLContext) -> None:
    shot = draw_shot(SEED, SMALL, rays=64)
    shot = replace(shot, maps={TRUE: shot.maps[TRUE]}, exposures=shot.exposures[-1:])
    figures = list(judge(LensCamera(gl), shot))
    by_method = {each.method: each.db for each in figures}
    assert by_method[OURS] > by_method[SHARP]
    text = "\n".join(report_parts(figures, 1))
    for method, decibels in by_method.items():
        assert f"| {TRUE} | {method} | {decibels:.2f} |" in text
