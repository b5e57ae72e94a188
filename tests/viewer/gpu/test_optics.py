"""Every part of the optics against brute force: shape, cat's-eye, tilt, range, highlights, dolly."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond.hidden_surfaces import HiddenSurface
from iibr_core.beyond.optics import HIGHLIGHT_GAIN, ApertureMask, ApertureShape, Optics
from iibr_core.color import linear_from_srgb
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.types import CENTRE, GridShape, ViewOffset
from tests.viewer.gpu.scenes import (
    TwoPlanes,
    eyes_of_pixels,
    first_frame,
    open_field,
    open_views,
    rms,
    settled,
    through_lens,
)

GRID = GridShape(5, 5)
SCENE = TwoPlanes()
BROAD = TwoPlanes(width=120, height=60, radius_px=0.0, contrast=0.3)
"""No disc before it, nothing but blur, and so broad that across and down are told apart."""
FAR_OFF = Optics(focus_disparity=3.0, aperture_diameter=4.0)
"""The wall is blurred over 16 px."""

CORNER = ApertureMask("corner", 2, 2, bytes([255, 255, 255, 0]))
BESIDE = replace(FAR_OFF, eye=ViewOffset(0.3, -0.4))
TILT = (3.0, -4.0)
TILTED = Optics(focus_disparity=0.5, focus_tilt=TILT, aperture_diameter=3.0)
LENSES = {
    "blades": (replace(BESIDE, aperture_shape=ApertureShape("polygon", blades=3, rotation_deg=30.0)), BESIDE),
    "a ring": (replace(BESIDE, aperture_shape=ApertureShape("ring", ring_inner=0.6)), BESIDE),
    "a mask": (replace(BESIDE, aperture_shape=ApertureShape("mask", mask=CORNER, rotation_deg=60.0)), BESIDE),
    "a cat's eye": (replace(BESIDE, aperture_shape=ApertureShape("cat_eye", cat_eye=1.0)), BESIDE),
    "a tilt": (TILTED, replace(TILTED, focus_tilt=(2.1, -2.8))),
    "a tilt the other way": (TILTED, replace(TILTED, focus_tilt=TILT[::-1])),
    "a dolly": (
        Optics(ViewOffset(0.3, -0.2), focus_disparity=2.0, dolly=1.0, aperture_diameter=3.0),
        Optics(ViewOffset(0.3, -0.2), focus_disparity=2.0, aperture_diameter=3.0),
    ),
}
"""Lenses, and lenses that are nearly the same."""
BAND = slice(10, -10)


@pytest.mark.parametrize("name", LENSES)
def test_lenses_against_brute_force(renderer, name):
    BROAD.fill(renderer, GRID)
    optics, other = LENSES[name]
    image = settled(renderer, optics, BROAD)
    difference = rms(image, through_lens(BROAD, optics))
    assert difference < 0.015
    assert rms(image, through_lens(BROAD, other)) > 1.5 * difference


def test_a_range_of_the_focus_leaves_what_is_beyond_it_less_defocused(renderer):
    """Half a range from the focus to the wall leaves the other half as blur: like a lens focused nearer to it."""
    BROAD.fill(renderer, GRID)
    lens = Optics(focus_disparity=3.0, aperture_diameter=3.0)
    ranged, nearer, other = (
        settled(renderer, replace(lens, **changes), BROAD)
        for changes in ({"focus_range": 2.0}, {"focus_disparity": 1.0}, {"focus_disparity": 1.5})
    )
    assert rms(ranged, nearer) < 0.003
    assert rms(ranged, other) > 0.008


def test_an_empty_mask_is_a_pinhole_not_a_black_picture(renderer):
    SCENE.fill(renderer, GRID)
    closed = ApertureShape("mask", mask=ApertureMask("closed", 2, 2, bytes(4)))
    image = settled(renderer, Optics(aperture_diameter=3.0, aperture_shape=closed), SCENE)
    assert np.abs(image.astype(int) - SCENE.view(CENTRE)[0]).max() <= 1


def test_highlights_count_for_more(renderer):
    """A white square far out of focus: all its light in the picture, against the formula. Its borders, where pixels are
    interpolated with dark ones, are no highlights.
    """
    grid, size, side_px, recovery = GridShape(3, 3), (64, 48), 12, 0.5
    colors = np.full((48, 64, 3), 60, np.uint8)
    colors[20 : 20 + side_px, 26 : 26 + side_px] = 255
    open_views(renderer, grid, colors, 0.0)
    optics = Optics(focus_disparity=4.0, aperture_diameter=3.0, highlight_recovery=recovery)
    dark = float(linear_from_srgb(np.array(60 / 255)))
    light = renderer.converged_picture(RenderSettings(optics, size, is_linear=True))[..., 0].astype(float)
    assert light[3, 3] == pytest.approx(dark, rel=0.05), "what is not clipped stays"
    counted = (light - light[3, 3]).sum() / side_px**2
    assert counted == pytest.approx(1 + HIGHLIGHT_GAIN * recovery - dark, rel=0.2)


def test_highlights_behind_an_edge_count_for_more_too(renderer):
    """A dark disc before a white wall: past its edge, an open lens sees wall that the eye does not."""
    size, optics = (96, 64), Optics(focus_disparity=1.0, aperture_diameter=4.0)
    y, x = np.indices(size[::-1])
    disparity = np.where(np.hypot(y - 32, x - 48) < 14, 6.0, 1.0).astype(np.float32)
    colors = np.where(disparity[..., None] > 2, 60, 255).astype(np.uint8).repeat(3, -1)
    open_field(renderer, GridShape(1, 1), *size)
    renderer.field.upload(0, 0, colors, disparity)
    renderer.field.set_hidden(
        HiddenSurface(np.ones((*size[::-1], 3), np.float32), np.ones_like(disparity), disparity > 0)
    )
    plain, bright = (
        renderer.converged_picture(RenderSettings(replace(optics, highlight_recovery=share), size, is_linear=True))
        for share in (0.0, 1.0)
    )
    inside = np.hypot(y - 32, x - 48) < 11
    wall_share = (plain[inside] - plain[32, 48]).mean()
    assert wall_share > 0.05
    assert (bright[inside] - bright[32, 48]).mean() == pytest.approx((1 + HIGHLIGHT_GAIN) * wall_share, rel=0.1)


def test_a_small_light_far_out_of_focus_spreads_over_many_blocks(renderer):
    """A lamp before a dark wall in focus; what stands between them elsewhere gives the blur slices of its own."""
    size, middle = (320, 96), (48.0, 103.0)
    y, x = np.indices(size[::-1]) + 0.5
    is_lamp, is_between = np.maximum(abs(y - middle[0]), abs(x - middle[1])) < 4, abs(x - 275) < 25
    disparity = np.select([is_lamp, is_between], [6.0, 3.0], 0.0).astype(np.float32)
    open_field(renderer, GridShape(1, 1), *size)
    renderer.field.upload(0, 0, (255 * is_lamp[..., None]).astype(np.uint8).repeat(3, -1), disparity)
    dark = np.zeros((*size[::-1], 3), np.float32)
    renderer.field.set_hidden(HiddenSurface(dark, np.zeros_like(disparity), disparity > 0))
    optics = Optics(aperture_diameter=12.0)
    picture = renderer.converged_picture(RenderSettings(optics, size, is_linear=True))[..., 0]
    away = np.hypot(y - middle[0], x - middle[1])
    expected = is_lamp.sum() / (np.pi * 36**2)
    assert picture[away < 30].mean() == pytest.approx(expected, rel=0.05)
    assert picture[(away > 26) & (away < 30)].min() > 0.5 * expected
    assert picture[away > 42].max() < 0.1 * expected


def test_nothing_shines_through_a_surface_that_lies_close_before_it(renderer):
    """A dark wall that comes towards the eye, a bright one a little behind it: their discs are nearly the same."""
    size = (96, 64)
    disparity = np.tile(np.linspace(-3, 3, size[0], dtype=np.float32), (size[1], 1))
    open_field(renderer, GridShape(1, 1), *size)
    renderer.field.upload(0, 0, np.full((*size[::-1], 3), 60, np.uint8), disparity)
    renderer.field.set_hidden(HiddenSurface(np.ones((*size[::-1], 3), np.float32), disparity - 0.6, disparity > -9))
    optics = Optics(aperture_diameter=2.0)
    picture = renderer.converged_picture(RenderSettings(optics, size, is_linear=True))
    dark = float(linear_from_srgb(np.array(60 / 255)))
    assert (picture - dark).mean() < 0.01
    assert (picture - dark).max() < 0.1


def test_saturated_colours_are_no_highlights(renderer):
    """A red wall whose red clips here and there: it shows the same with highlights recovered as without."""
    colors = np.full((30, 40, 3), (250, 90, 10), np.uint8)
    colors[::3, ::4, 0] = 255
    open_views(renderer, GridShape(3, 3), colors, 0.0)
    optics = [replace(FAR_OFF, highlight_recovery=recovery) for recovery in (0, 1)]
    plain, recovered = (first_frame(renderer, each, TwoPlanes(40, 30)) for each in optics)
    assert np.abs(plain.astype(int) - recovered).max() <= 2


def test_dolly_through_a_pinhole_against_the_scene(renderer):
    """The scene itself seen along each pixel's own ray, also where that crosses beside the grid."""
    SCENE.fill(renderer, GRID)
    optics = Optics(ViewOffset(0.25, -0.5), dolly=6.0)
    truth, _ = SCENE.view(ViewOffset(*eyes_of_pixels(optics, SCENE)))
    image = settled(renderer, optics, SCENE)
    assert np.median(np.abs(image.astype(int) - truth)[BAND, BAND]) <= 1
    assert rms(image, truth, border=14) < 0.035
