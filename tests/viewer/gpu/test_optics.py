"""Every part of the optics against a plain numpy twin: shape, cat's-eye, tilt, range, highlights, dolly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.rendering.optics import CENTRE, HIGHLIGHT_GAIN, ApertureMask, ApertureShape, Optics
from iibr_core.types import GridShape, ViewOffset
from tests.image_compare import FILTERING, assert_close
from tests.viewer.gpu.scenes import TwoPlanes, rms, through_aperture
from viewer.gpu.refocus.picture_renderer import Renderer
from viewer.gpu.refocus.view_sampling import aperture_samples

GRID = GridShape(5, 5)
FULL = np.ones(GRID, bool)
SCENE = TwoPlanes()
FLAT = TwoPlanes(foreground=-1.0)
"""One plane in effect: disc and background have the same disparity."""

CROSS = ApertureMask("cross", 3, 3, bytes([0, 255, 0, 255, 255, 255, 0, 255, 0]))
SHAPES = [
    ApertureShape("polygon", blades=3, rotation_deg=30.0),
    ApertureShape("polygon", blades=7),
    ApertureShape("ring", ring_inner=0.6),
    ApertureShape("mask", mask=CROSS),
]
BAND = slice(10, -10)


def picture(renderer: Renderer, optics: Optics, scene: TwoPlanes = SCENE) -> NDArray[np.uint8]:
    renderer.render(optics, (scene.width, scene.height))
    return renderer.read_image()


def eyes_of_pixels(optics: Optics, scene: TwoPlanes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Twin: where each pixel's ray crosses the grid, (t, s)."""
    y, x = np.indices((scene.height, scene.width))
    half = scene.width / 2
    return (
        optics.eye.t - optics.dolly * (y + 0.5 - scene.height / 2) / half,
        optics.eye.s - optics.dolly * (x + 0.5 - half) / half,
    )


def focus_of_pixels(optics: Optics, scene: TwoPlanes) -> NDArray[np.float64]:
    """Twin: the sharp disparity of each pixel."""
    y, x = np.indices((scene.height, scene.width))
    right, lower = optics.focus_tilt
    return (
        optics.focus_disparity
        + right * (x + 0.5 - scene.width / 2) / (scene.width / 2)
        + lower * (y + 0.5 - scene.height / 2) / (scene.height / 2)
    )


def background(scene: TwoPlanes, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear light of the background of a view, at real places."""
    return linear_from_srgb(scene._texture(x, y, hue=0.0)).astype(float)


def of_background(scene: TwoPlanes, optics: Optics) -> NDArray[np.uint8]:
    """Twin: the background alone through the lens, every ray followed."""
    y, x = np.indices((scene.height, scene.width)).astype(float)
    t, s = eyes_of_pixels(optics, scene)
    by = scene.background - focus_of_pixels(optics, scene)
    samples = aperture_samples(optics.eye, max(optics.aperture_diameter, 1.0), GRID, FULL)
    if optics.aperture_diameter == 0:
        samples = [sample._replace(wanted=optics.eye, weight=1 / len(samples)) for sample in samples]
    total = np.zeros((scene.height, scene.width, 3))
    for sample in samples:
        ds, dt = sample.wanted.s - optics.eye.s, sample.wanted.t - optics.eye.t
        total += sample.weight * background(
            scene, x + scene.background * s + by * ds, y + scene.background * t + by * dt
        )
    return np.rint(srgb_from_linear(total / sum(sample.weight for sample in samples)) * 255).astype(np.uint8)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("eye", [CENTRE, ViewOffset(0.0, 1.0)])
def test_shapes_against_numpy(renderer: Renderer, tmp_path: Path, shape: ApertureShape, eye: ViewOffset) -> None:
    SCENE.fill(renderer, GRID)
    renderer.prefilter = False
    optics = Optics(eye, focus_disparity=2.0, aperture_diameter=3.0, aperture_shape=shape)
    samples = aperture_samples(eye, 3.0, GRID, FULL, shape)
    assert all(SCENE.view(sample.wanted)[0].any() for sample in samples)
    expected = through_aperture(SCENE, [s.wanted for s in samples], [s.weight for s in samples], eye, 2.0)
    image = picture(renderer, optics)
    inside = slice(8, -8)
    assert_close(image[inside, inside], expected[inside, inside], FILTERING, tmp_path)


def test_an_empty_mask_is_a_pinhole_not_a_black_picture(renderer: Renderer) -> None:
    SCENE.fill(renderer, GRID)
    renderer.prefilter = False
    closed = ApertureShape("mask", mask=ApertureMask("closed", 2, 2, bytes(4)))
    image = picture(renderer, Optics(aperture_diameter=3.0, aperture_shape=closed))
    assert np.abs(image.astype(int) - SCENE.view(CENTRE)[0]).max() <= 1


def test_cats_eye_cuts_the_lens_off_toward_the_corners(renderer: Renderer, tmp_path: Path) -> None:
    FLAT.fill(renderer, GRID)
    renderer.prefilter = False
    optics = Optics(focus_disparity=1.0, aperture_diameter=4.0, aperture_shape=ApertureShape("cat_eye", cat_eye=1.0))
    y, x = np.indices((FLAT.height, FLAT.width)).astype(float)
    corner = np.hypot(FLAT.width / 2, FLAT.height / 2)
    barrel_s, barrel_t = 2.0 * (x + 0.5 - FLAT.width / 2) / corner, 2.0 * (y + 0.5 - FLAT.height / 2) / corner
    total, weights = np.zeros((FLAT.height, FLAT.width, 3)), np.zeros((FLAT.height, FLAT.width, 1))
    for sample in aperture_samples(CENTRE, 4.0, GRID, FULL, optics.aperture_shape):
        moved = round(sample.wanted.t), round(sample.wanted.s)
        light = np.roll(linear_from_srgb(FLAT.view(sample.wanted)[0] / 255), moved, axis=(0, 1))
        left = np.clip(0.5 + 2.0 - np.hypot(sample.wanted.s - barrel_s, sample.wanted.t - barrel_t), 0, 1)
        total += sample.weight * left[..., None] * light
        weights += sample.weight * left[..., None]
    expected = np.rint(srgb_from_linear(total / weights) * 255).astype(np.uint8)
    image = picture(renderer, optics, FLAT)
    inside = slice(4, -4)
    assert_close(image[inside, inside], expected[inside, inside], FILTERING, tmp_path)
    disc = picture(renderer, replace(optics, aperture_shape=ApertureShape()), FLAT)
    assert rms(disc, image, border=4) > 0.01


@pytest.mark.parametrize("tilt", [(1.0, 0.0), (0.0, -2.0), (1.5, 1.0)])
def test_tilt_against_numpy(renderer: Renderer, tilt: tuple[float, float]) -> None:
    FLAT.fill(renderer, GRID)
    renderer.prefilter = False
    optics = Optics(focus_disparity=-1.0, focus_tilt=tilt, aperture_diameter=3.0)
    image, expected = picture(renderer, optics, FLAT), of_background(FLAT, optics)
    off_disc = np.hypot(*(np.indices(image.shape[:2]) - np.array([[[36]], [[48]]]))) > 30
    difference = np.abs(image.astype(int) - expected).max(-1)[BAND, BAND][off_disc[BAND, BAND]]
    assert difference.max() <= 4
    level = picture(renderer, replace(optics, focus_tilt=(0.0, 0.0)), FLAT)
    assert rms(level, image) > 0.005


def test_everything_within_the_focus_range_is_as_sharp_as_through_a_pinhole(renderer: Renderer) -> None:
    scene = TwoPlanes(background=-3.0, foreground=4.0)
    scene.fill(renderer, GRID)
    eye = ViewOffset(0.2, -0.3)
    truth = scene.view(eye)[0]
    wide = Optics(eye, focus_disparity=0.5, aperture_diameter=4.0)
    sharp = picture(renderer, replace(wide, focus_range=4.0), scene)
    assert rms(sharp, truth, border=10) < 0.025, "depth edges within a pixel"
    assert np.median(np.abs(sharp.astype(int) - truth)) <= 1
    assert rms(picture(renderer, wide, scene), truth, border=10) > 0.08


def test_focus_range_leaves_what_is_beyond_it_less_defocused(renderer: Renderer) -> None:
    """Half a range from the focus to the background leaves the other half as blur: like a lens half as wide."""
    FLAT.fill(renderer, GRID)
    renderer.prefilter = False
    ranged = picture(renderer, Optics(focus_disparity=1.0, focus_range=1.0, aperture_diameter=3.0), FLAT)
    expected = picture(renderer, Optics(focus_disparity=0.0, aperture_diameter=3.0), FLAT)
    assert rms(ranged, expected) < 0.004


@pytest.mark.parametrize("recovery", [0.0, 0.5, 1.0])
def test_highlights_count_for_more(renderer: Renderer, recovery: float) -> None:
    """A white dot far out of focus: its light in the picture, over that of all samples, against the formula."""
    grid, size = GridShape(3, 3), (40, 30)
    renderer.open_field(grid, *size, hdr=False, with_disparity=True)
    renderer.prefilter = False
    for row, column in np.ndindex(*grid):
        colors = np.full((30, 40, 3), 60, np.uint8)
        colors[15, 20] = 255
        renderer.upload_view(row, column, colors, np.zeros((30, 40), np.float32))
    optics = Optics(focus_disparity=4.0, aperture_diameter=3.0, highlight_recovery=recovery, exposure_stops=-2.0)
    renderer.render(optics, size)
    light = linear_from_srgb(renderer.read_image() / 255)[..., 0] * 4
    weight = {s.wanted: s.weight for s in aperture_samples(CENTRE, 3.0, grid, np.ones(grid, bool))}[CENTRE]
    dark = float(linear_from_srgb(np.array(60 / 255)))
    expected = weight * (1 + HIGHLIGHT_GAIN * recovery) + (1 - weight) * dark
    assert light[15, 20] == pytest.approx(min(expected, 4), rel=0.03)
    assert light[3, 3] == pytest.approx(dark, rel=0.05), "what is not clipped stays"


def test_saturated_colours_are_no_highlights(renderer: Renderer) -> None:
    """A red wall whose red clips here and there: it shows the same with highlights recovered as without."""
    grid, size = GridShape(3, 3), (40, 30)
    renderer.open_field(grid, *size, hdr=False, with_disparity=True)
    colors = np.full((30, 40, 3), (250, 90, 10), np.uint8)
    colors[::3, ::4, 0] = 255
    for row, column in np.ndindex(*grid):
        renderer.upload_view(row, column, colors, np.zeros((30, 40), np.float32))
    plain, recovered = (
        picture(renderer, Optics(focus_disparity=4.0, aperture_diameter=3.0, highlight_recovery=r)) for r in (0.0, 1.0)
    )
    assert np.abs(plain.astype(int) - recovered).max() <= 2


def test_highlight_recovery_leaves_a_pinhole_alone(renderer: Renderer) -> None:
    SCENE.fill(renderer, GRID)
    plain = picture(renderer, Optics(ViewOffset(0.3, 0.2)))
    assert np.array_equal(plain, picture(renderer, Optics(ViewOffset(0.3, 0.2), highlight_recovery=1.0)))


@pytest.mark.parametrize("dolly", [1.5, -2.0, 6.0])
def test_dolly_through_a_pinhole_against_the_scene(renderer: Renderer, dolly: float) -> None:
    """The scene itself seen along each pixel's own ray, also where that crosses beside the grid."""
    SCENE.fill(renderer, GRID)
    optics = Optics(ViewOffset(0.25, -0.5), dolly=dolly)
    truth, _ = SCENE.view(ViewOffset(*eyes_of_pixels(optics, SCENE)))  # type: ignore[arg-type]
    image = picture(renderer, optics)
    assert np.median(np.abs(image.astype(int) - truth)[BAND, BAND]) <= 1
    assert rms(image, truth, border=14) < 0.035


@pytest.mark.parametrize("present", [1, 9, 25])
def test_dolly_through_a_lens_against_numpy(renderer: Renderer, present: int) -> None:
    FLAT.open(renderer, GRID)
    order = sorted(np.ndindex(*GRID), key=lambda at: np.hypot(at[0] - 2, at[1] - 2))
    for at in order[:present]:
        FLAT.upload(renderer, GRID, *at)
    renderer.prefilter = False
    optics = Optics(focus_disparity=1.0, dolly=1.0, aperture_diameter=2.0)
    image, expected = picture(renderer, optics, FLAT), of_background(FLAT, optics)
    off_disc = np.hypot(*(np.indices(image.shape[:2]) - np.array([[[36]], [[48]]]))) > 30
    assert np.abs(image.astype(int) - expected).max(-1)[BAND, BAND][off_disc[BAND, BAND]].max() <= 5


def test_nothing_jumps_as_dolly_tilt_and_range_grow_from_nothing(renderer: Renderer) -> None:
    SCENE.fill(renderer, GRID)
    plain = Optics(ViewOffset(0.3, 0.1), focus_disparity=1.0, aperture_diameter=3.0)
    before = picture(renderer, plain)
    for optics in (
        replace(plain, dolly=1e-4),
        replace(plain, focus_tilt=(1e-4, -1e-4)),
        replace(plain, focus_range=1e-4),
        replace(plain, highlight_recovery=1e-4),
        replace(plain, aperture_shape=ApertureShape("cat_eye", cat_eye=1e-4)),
        replace(plain, aperture_shape=ApertureShape("ring", ring_inner=0.0)),
    ):
        assert rms(picture(renderer, optics), before, border=4) < 0.02, optics


@pytest.mark.parametrize("optics", [Optics(dolly=2.0), Optics(focus_range=1.0), Optics(focus_tilt=(2.0, 1.0))])
@pytest.mark.parametrize("diameter", [0.0, 0.5, 1.5, 4.0])
@pytest.mark.parametrize("present", [1, 6])
def test_a_constant_photo_stays_constant(renderer: Renderer, optics: Optics, diameter: float, present: int) -> None:
    renderer.open_field(GRID, 64, 48, hdr=False, with_disparity=True)
    for index in [12, 0, 24, 3, 7, 20][:present]:
        _, disparity = TwoPlanes(64, 48, -6, 9).view(GRID.offset(*divmod(index, 5)))
        renderer.upload_view(*divmod(index, 5), np.full((48, 64, 3), (10, 130, 250), np.uint8), disparity)
    for shape in (ApertureShape(), ApertureShape("cat_eye", cat_eye=1.0)):
        wanted = replace(optics, eye=ViewOffset(0.4, -0.7), aperture_diameter=diameter, aperture_shape=shape)
        renderer.render(wanted, (64, 48))
        assert np.abs(renderer.read_image().astype(int) - (10, 130, 250)).max() <= 1, wanted
