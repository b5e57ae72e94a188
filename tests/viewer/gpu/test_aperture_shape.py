"""Openings against plain point tests: many points of a sample's square, each inside or not."""

import numpy as np
import pytest

from iibr_core.beyond.aperture_shape import opening
from iibr_core.beyond.optics import ApertureMask, ApertureShape

DIAMETER = 8.0
WIDTH = 0.5
T, S = np.meshgrid(np.arange(-5, 5.01, 0.25), np.arange(-5, 5.01, 0.25), indexing="ij")


def is_inside(shape, t, s):
    """Twin: whether a point lies in the opening; polygons as half planes through neighbouring corners."""
    if shape.kind == "ring":
        return (np.hypot(t, s) < DIAMETER / 2) & (np.hypot(t, s) > DIAMETER / 2 * shape.ring_inner)
    if shape.kind != "polygon":
        return np.hypot(t, s) < DIAMETER / 2
    turn = np.radians(shape.rotation_deg) + 2 * np.pi * np.arange(shape.blades + 1) / shape.blades
    corner_s, corner_t = DIAMETER / 2 * np.sin(turn), -DIAMETER / 2 * np.cos(turn)  # the first on top, then clockwise
    if shape.roundness:  # by the radius at each angle, between that of the polygon and the circle's
        half, angle = np.pi / shape.blades, np.arctan2(s, -t) - np.radians(shape.rotation_deg)
        beside, bend = np.mod(angle, 2 * half) - half, shape.roundness
        radius = ((1 - bend) * np.cos(half) + bend) / ((1 - bend) * np.cos(beside) + bend)
        return np.hypot(t, s) < DIAMETER / 2 * radius
    inside = np.ones(t.shape, bool)
    for k in range(shape.blades):
        along_s, along_t = corner_s[k + 1] - corner_s[k], corner_t[k + 1] - corner_t[k]
        inside &= along_s * (t - corner_t[k]) - along_t * (s - corner_s[k]) > 0
    return inside


def share_inside(shape):
    """Twin: share of 20 x 20 points of each sample's square."""
    within = ((np.arange(20) + 0.5) / 20 - 0.5) * WIDTH
    return np.mean([is_inside(shape, T + dt, S + ds) for dt in within for ds in within], axis=0)


@pytest.mark.parametrize(
    "shape",
    [
        ApertureShape(),
        ApertureShape("ring", ring_inner=0.6),
        ApertureShape("polygon", blades=11, rotation_deg=-70.0),
        ApertureShape("polygon", blades=4, rotation_deg=20.0, roundness=0.4),
    ],
)
def test_openings_against_point_tests(shape):
    weights, expected = opening(shape, T, S, DIAMETER, WIDTH), share_inside(shape)
    assert np.abs(weights - expected).max() < 0.4, "a corner's square is not a straight edge's"
    assert np.abs(weights - expected).mean() < 0.01
    decided = (expected == 0) | (expected == 1)
    assert np.abs(weights - expected)[decided].max() < 0.3, "only near the edge"
    assert weights.sum() == pytest.approx(expected.sum(), rel=0.01)


def test_mask_lies_upright_and_turns_clockwise():
    values = np.zeros((4, 8), np.uint8)
    values[0, 0], values[3] = 255, 51  # upper left corner open, lowest row a fifth
    shape = ApertureShape("mask", mask=ApertureMask("corner", 4, 8, values.tobytes()))

    def at(t, s, rotation_deg=0.0):
        turned = ApertureShape("mask", rotation_deg=rotation_deg, mask=shape.mask)
        return float(opening(turned, np.array([t]), np.array([s]), 8.0, 0.5)[0])

    assert at(-1.5, -3.5) == 1
    assert at(1.5, 2.5) == pytest.approx(0.2)
    assert at(-0.5, 0.0) == 0
    assert at(-3.5, 1.5, rotation_deg=90.0) == pytest.approx(1, abs=0.02)
    assert at(-2.5, 0.0) == 0, "beyond the shorter side"
    assert at(1.5, -4.0) == pytest.approx(0.1), "half of the sample is off the image"
