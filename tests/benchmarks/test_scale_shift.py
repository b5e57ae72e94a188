"""The benchmark of scale and shift: what it compares is what it says."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from benchmarks.scale_shift_network import Network, color
from benchmarks.scale_shift_scenes import Scenes, by_rule, normalised
from iibr_core.generation.plan import plan_for_viewing
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import TOTAL_PARALLAX, Disparity, FloatImage, ImageSize, Photo, ViewOffset

SIZE = ImageSize(40, 48)


def ramp() -> FloatImage:
    y, x = np.indices(SIZE, np.float32)
    return (3 * y + x) / np.float32(SIZE[1]) - np.float32(1.5)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 400.0])
def test_a_normalised_map_gives_the_disparity_back(scale: float) -> None:
    disparity = ramp() * np.float32(scale)
    disparity[3, 4] = np.nan
    relative, alpha, beta = normalised(disparity)
    assert np.nanpercentile(relative, [1, 99]) == pytest.approx([0, 1], abs=1e-6)
    np.testing.assert_allclose(alpha * relative + beta, disparity, atol=1e-6 * scale)


def test_the_rule_gives_the_parallax_of_viewing_and_leaves_the_median_still() -> None:
    relative, _, _ = normalised(ramp())
    log_alpha, place = by_rule(relative)
    assert 2**log_alpha == pytest.approx(100 * TOTAL_PARALLAX / 2, rel=1e-4)
    assert place == pytest.approx(-float(np.median(relative)), abs=1e-4)


@pytest.mark.parametrize(("alpha", "beta"), [(0.01, 0.0), (3.0, -7.0), (40.0, 100.0)])
def test_the_plan_for_viewing_cancels_scale_and_shift(alpha: float, beta: float) -> None:
    photo = Photo(np.zeros((*SIZE, 3), np.float32), 50.0, "grey")
    fields = []
    for given in (ramp(), ramp() * np.float32(alpha) + np.float32(beta)):
        disparity = Disparity(given, "ramp")
        fields.append(plan_for_viewing(photo, disparity).field_disparity(disparity).values)
    np.testing.assert_allclose(fields[0], fields[1], atol=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_a_photo_does_not_show_how_far_apart_the_cameras_are(seed: int) -> None:
    """Powers of two, so that rounding is alike; where it is not, a pattern's cell may change its colour."""
    photos, maps = [], []
    for largest in (1.0, 8.0):
        colors, disparity = render(random_scene(np.random.default_rng(seed), SIZE, largest), SIZE, ViewOffset(0.0, 0.0))
        photos.append(colors)
        maps.append(normalised(disparity)[0])
    assert np.abs(photos[0] - photos[1]).mean() < 1e-3
    np.testing.assert_allclose(maps[0], maps[1], atol=1e-4)


def test_the_colour_loss_is_least_at_the_true_scale_and_shift() -> None:
    """A slow wave, moved by 2 px: alpha 4 % of the width, beta / alpha 1/24, of a map that is 1 everywhere."""
    x = np.arange(SIZE[1])
    photo, view = (torch.tensor(0.5 + 0.4 * np.sin((x + moved) / 8), dtype=torch.float32) for moved in (0, 2))
    rows = [torch.ones(1, 3, *SIZE) * line for line in (photo, view)]
    picture = torch.cat([rows[0], torch.ones(1, 1, *SIZE)], dim=1)
    truth = torch.tensor([[math.log2(4.0), 1 / 24]])
    scenes = Scenes(picture, rows[1], truth, truth, truth)
    network = Network(4, truth.repeat(2, 1))
    losses = {change: float(color(network, truth + torch.tensor([[change, 0.0]]), scenes)) for change in (-0.5, 0, 0.5)}
    assert losses[0] < 0.5 * min(losses[-0.5], losses[0.5])
