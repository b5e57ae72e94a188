"""What is drawn blurs as wide as the aperture asks for: samples, their soft edges, and the smoothing between them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear, stored_from_encoded
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.rendering.optics import CENTRE, ApertureMask, ApertureShape, Optics
from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.refocus.frame_budget import BEST_QUALITY, QualityLevel
from viewer.gpu.refocus.picture_renderer import Renderer
from viewer.gpu.refocus.view_sampling import ApertureSample, aperture_samples

GRID = GridShape(17, 17)
FULL = np.ones(GRID, bool)
CROSS = ApertureMask("cross", 3, 3, bytes([0, 255, 0, 255, 255, 255, 0, 255, 0]))
DISC = ApertureShape()
TRIANGLE = ApertureShape("polygon", blades=3)
OF_UNIT_RADIUS = {
    DISC: 1 / 4,
    ApertureShape("polygon", blades=6): (2 + np.cos(2 * np.pi / 6)) / 12,
    TRIANGLE: (2 + np.cos(2 * np.pi / 3)) / 12,
    ApertureShape("ring", ring_inner=0.5): (1 + 0.5**2) / 4,
    ApertureShape("mask", mask=CROSS): (2 / 3) ** 2 * (1 / 12 + 2 / 5),
}
"""Second moments per axis, from geometry."""


def second_moment(samples: list[ApertureSample], eye: ViewOffset) -> float:
    """Twin: per axis, mean of both, of the light as it is summed."""
    places = np.array([sample.wanted for sample in samples]) - eye
    weights = np.array([sample.weight for sample in samples])
    return float(weights @ (places**2).sum(1)) / 2 / weights.sum()


@pytest.mark.parametrize("shape", OF_UNIT_RADIUS)
@pytest.mark.parametrize("stride", [1, 2, 3])
@pytest.mark.parametrize("eye", [CENTRE, ViewOffset(0.5, 0.5), ViewOffset(0.3, -0.2)])
def test_samples_and_smoothing_have_the_second_moment_of_the_opening(
    shape: ApertureShape, stride: int, eye: ViewOffset
) -> None:
    """Of few samples the smoothing alone may be wider than a triangle: it is drawn from two strides on."""
    least = {TRIANGLE: 2.0 * stride, DISC: 1.25 * stride if eye == (0.5, 0.5) else stride}.get(shape, 1.5 * stride)
    for radius in (1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0):
        if radius >= least:
            samples = aperture_samples(eye, 2 * radius, GRID, FULL, shape, stride, is_smoothed=True)
            drawn = second_moment(samples, eye) + stride**2 / 12
            assert drawn == pytest.approx(radius**2 * OF_UNIT_RADIUS[shape], rel=0.02), radius


@pytest.mark.parametrize("stride", [1, 2, 3])
def test_without_smoothing_the_samples_alone_have_it(stride: int) -> None:
    for radius in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0):
        if radius >= stride:
            samples = aperture_samples(CENTRE, 2 * radius, GRID, FULL, stride=stride)
            assert second_moment(samples, CENTRE) == pytest.approx(radius**2 / 4, rel=0.02)


@pytest.mark.parametrize("is_smoothed", [True, False])
@pytest.mark.parametrize("shape", OF_UNIT_RADIUS)
def test_the_width_grows_with_the_aperture_and_never_jumps(shape: ApertureShape, is_smoothed: bool) -> None:
    """From the first light through the aperture on, below which all is pinhole."""
    eye, widths = ViewOffset(0.3, -0.2), []
    for diameter in np.arange(1.0, 8.0, 0.02):
        samples = aperture_samples(eye, float(diameter), GRID, FULL, shape, is_smoothed=is_smoothed)
        widths.append(min(diameter - 1, 1) * second_moment(samples, eye))
    steps = np.array([after - before for before, after in pairwise(widths)])
    assert widths[0] == 0
    assert np.abs(steps).max() < 0.06
    assert steps.min() > -0.02


def test_beyond_the_grid_every_view_counts_alike() -> None:
    grid = GridShape(5, 5)
    for is_smoothed in (True, False):
        samples = aperture_samples(CENTRE, 99.0, grid, np.ones(grid, bool), is_smoothed=is_smoothed)
        assert [sample.weight for sample in samples] == pytest.approx([1 / 25] * 25, rel=0.01)


def width_of_spot(renderer: Renderer, optics: Optics, level: QualityLevel | None) -> float:
    """Second moment per axis by which a soft spot out of focus grows, view steps. level: None = converged."""
    grid, size, px_per_view, own_px = GridShape(9, 9), (128, 128), 8.0, 4.0
    y, x = np.indices(size)
    renderer.open_field(grid, *size, hdr=True, with_disparity=True)
    for row, column in np.ndindex(*grid):
        t, s = grid.offset(row, column)
        spot = np.exp(-((y - 64 + px_per_view * t) ** 2 + (x - 64 + px_per_view * s) ** 2) / 2 / own_px**2)
        encoded = srgb_from_linear(2 * spot[..., None].repeat(3, axis=2))
        renderer.upload_view(row, column, stored_from_encoded(encoded, True), np.full(size, px_per_view, np.float32))
    if level is None:
        light = renderer.converged_picture(RenderSettings(optics, size, is_linear=True))[..., 0].astype(float)
    else:
        renderer.render(optics, size, level=level)
        light = linear_from_srgb(renderer.read_image()[..., 0] / 255).astype(float)
    assert light.max() < 1
    in_all_px = (light * ((x - 64) ** 2 + (y - 64) ** 2)).sum() / light.sum() / 2
    return float((in_all_px - own_px**2) / px_per_view**2)


@pytest.mark.parametrize("level", [None, BEST_QUALITY, QualityLevel(2), QualityLevel(3)])
def test_a_spot_of_light_is_drawn_as_wide_as_the_lens_has_it(renderer: Renderer, level: QualityLevel | None) -> None:
    """The whole way: samples, half size, smoothing, and all rounds."""
    for radius in (1.5, 2.0, 3.0):
        width = width_of_spot(renderer, Optics(aperture_diameter=2 * radius), level)
        assert width == pytest.approx(radius**2 / 4, rel=0.02), radius
