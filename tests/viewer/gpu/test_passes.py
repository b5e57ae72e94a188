"""Each pass between light field and picture against numpy: spans of searches, defocus, smoothing, layers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from iibr_core.color import srgb_from_linear
from iibr_core.rendering.optics import CENTRE, Optics
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes, rms
from viewer.gpu.refocus.passes import TILE_PX, Passes, _search_steps
from viewer.gpu.refocus.picture_cells import WHOLE_CELL
from viewer.gpu.refocus.picture_lens import Lens, lens_of, passes_for
from viewer.gpu.refocus.picture_renderer import Renderer
from viewer.gpu.refocus.view_sampling import pinhole_sources
from viewer.gpu.render_targets import RenderTargets

GRID = GridShape(5, 5)
SCENE = TwoPlanes(width=160, height=96, background=-4.0, foreground=5.0, radius_px=25.0)
SIZE = SCENE.width, SCENE.height
RANDOM = np.random.default_rng(5)


@pytest.fixture
def passes(renderer: Renderer) -> Passes:
    return renderer._accumulator.passes


@pytest.fixture
def targets(renderer: Renderer) -> RenderTargets:
    return renderer._screen.targets_of(SIZE)


def lens(renderer: Renderer, optics: Optics) -> Lens:
    assert renderer.field is not None
    return lens_of(optics, renderer.field, SIZE[0], prefilter=True)


def read(texture: object, channels: int = 4) -> NDArray[np.float32]:
    width, height = texture.size  # type: ignore[attr-defined]
    return np.frombuffer(texture.read(), np.float32).reshape(height, width, channels)  # type: ignore[attr-defined]


def first_step_that_finds(
    disparity: NDArray[np.float32], delta: NDArray[np.float64], steps: int, ends: tuple
) -> NDArray:
    """Twin of the search, for every pixel: the step it ends at, -1 where it finds nothing. delta: px per px (x, y)."""
    far, near = ends
    stride = (near - far) / steps
    y, x = np.indices(disparity.shape) + 0.5
    found = np.full(disparity.shape, -1)
    for k in range(steps + 1):
        d = near - stride * k
        seen = looked_up(disparity, x - delta[0] * d, y - delta[1] * d)
        refined = looked_up(disparity, x - delta[0] * seen, y - delta[1] * seen)
        ends_here = (seen - d >= -0.5 * stride) & ((seen - d <= 1.5 * stride) | (k == 0))
        ends_here &= refined >= seen - 1.5 * stride
        found[ends_here & (found < 0)] = k
    return found


def looked_up(image: NDArray[np.float32], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float32]:
    rows = np.clip(np.floor(y), 0, image.shape[0] - 1).astype(int)
    return image[rows, np.clip(np.floor(x), 0, image.shape[1] - 1).astype(int)]


@pytest.mark.parametrize("eye", [ViewOffset(0.37, -0.73), ViewOffset(-1.21, 3.43)])
def test_no_search_ends_outside_its_tiles_span(
    renderer: Renderer, passes: Passes, targets: RenderTargets, eye: ViewOffset
) -> None:
    SCENE.fill(renderer, GRID)
    field, view = renderer.field, lens(renderer, Optics(eye))
    assert field is not None
    field.range_px = -10.0, 11.0  # wider than what is there: something can be saved
    passes._find_march_intervals(field, view, WHOLE_CELL, WHOLE_CELL, targets)
    spans = np.concatenate([read(texture) for texture in targets.spans.textures], axis=-1)
    flat = spans[..., 1] < 0
    assert 0.1 < flat.mean() < 0.9
    for i, (row, column, _) in enumerate(pinhole_sources(eye, GRID, field.present)):
        there = GRID.offset(row, column)
        _, disparity = SCENE.view(there)
        steps = _search_steps(field, view, there, WHOLE_CELL)
        delta = np.array([there.s - eye.s, there.t - eye.t])
        found = first_step_that_finds(disparity, delta, steps, field.range_px)
        tiles = found.reshape(SIZE[1] // TILE_PX, TILE_PX, SIZE[0] // TILE_PX, TILE_PX).swapaxes(1, 2)
        first, last = spans[..., 2 * i, None, None], spans[..., 2 * i + 1, None, None]
        within = (tiles < 0) | ((tiles >= first) & (tiles <= last))
        assert within[~flat].all()
        assert (last - first)[~flat].max() < steps
        stride = (field.range_px[1] - field.range_px[0]) / steps
        one = field.range_px[1] - stride * tiles
        assert (np.abs(one - first)[flat & (tiles >= 0).all((-2, -1))] <= 2.5 * stride).all(), "flat: near the surface"


@pytest.mark.parametrize("optics", [Optics(ViewOffset(0.4, -0.7)), Optics(ViewOffset(0.3, 2.7), dolly=2.0)])
@pytest.mark.parametrize("present", [1, 5, 25])
def test_tiles_change_nothing_about_a_pinhole_view(renderer: Renderer, optics: Optics, present: int) -> None:
    SCENE.open(renderer, GRID)
    for index in [12, 0, 4, 20, 24, *range(25)][: present + 5 if present == 25 else present]:
        SCENE.upload(renderer, GRID, *divmod(index, 5))
    images = []
    for renderer.adaptive in (True, False):
        renderer.render(optics, SIZE)
        images.append(renderer.read_image())
    assert np.mean(np.abs(images[0].astype(int) - images[1]).max(-1) > 2) < 0.001


def test_defocus_of_tiles_against_numpy(renderer: Renderer, passes: Passes, targets: RenderTargets) -> None:
    SCENE.fill(renderer, GRID)
    field, wide = renderer.field, lens(renderer, Optics(focus_disparity=1.0, aperture_diameter=3.0))
    assert field is not None
    samples = wide.samples(GRID, field.present)
    list(passes.find_defocus(field, wide, samples, targets))
    seen = read(targets.tiles.textures[0])
    rows, columns = SIZE[1] // TILE_PX, SIZE[0] // TILE_PX
    widest = np.zeros((rows, columns, 2))
    for sample in samples:
        _, disparity = SCENE.view(sample.wanted)
        y, x = np.indices(disparity.shape) + 0.5
        shifted = looked_up(
            disparity,
            x - wide.optics.focus_disparity * sample.wanted.s,
            y - wide.optics.focus_disparity * sample.wanted.t,
        )
        beside = (shifted - 1.0).reshape(rows, TILE_PX, columns, TILE_PX)
        widest[..., 0] = np.maximum(widest[..., 0], beside.max((1, 3)))
        widest[..., 1] = np.maximum(widest[..., 1], (-beside).max((1, 3)))
    assert (seen[..., :2] >= wide.blur_px * widest - 1e-3).all(), "no blur is overlooked"
    assert np.mean(np.abs(seen[..., :2] - wide.blur_px * widest).max(-1) < 1e-2) > 0.5, "and mostly it is as wide"
    around = read(targets.wide_tiles.textures[0])[..., :2]
    reach = min(int(np.ceil((wide.widest_blur_px / 2 + TILE_PX / 2) / TILE_PX)), 4)
    padded = np.pad(seen[..., :2], ((reach, reach), (reach, reach), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * reach + 1, 2 * reach + 1), axis=(0, 1))
    assert np.array_equal(around, windows.max((-2, -1)))


def test_tiles_get_the_passes_that_their_blur_needs_and_weigh_alike(renderer: Renderer) -> None:
    scene = TwoPlanes(width=480, height=96, background=1.0, foreground=5.0, radius_px=25.0)
    scene.fill(renderer, GRID)
    renderer.render(Optics(focus_disparity=0.5, aperture_diameter=4.0), (scene.width, scene.height))
    while not renderer.is_converged:
        renderer.refine(budget_s=1.0)
    targets, accumulation = renderer._screen.shown, renderer._current()
    count = len(accumulation.places)
    widest = read(targets.wide_tiles.textures[0])
    blur = widest[..., :2].max(-1)
    np.testing.assert_array_equal(widest[..., 2], np.vectorize(passes_for)(blur))
    assert (widest[..., 2].min(), widest[..., 2].max(), count) == (1, 9, 10)
    weight = sum(read(texture)[..., 3] for texture in targets.layers.sums.textures)
    # Beside the border some samples know nothing.
    np.testing.assert_allclose(weight[24:-24, 24:-24], count, rtol=1e-4)


def test_smoothing_narrows_with_the_passes_that_a_tile_got(
    renderer: Renderer, passes: Passes, targets: RenderTargets
) -> None:
    SCENE.fill(renderer, GRID)
    wide = lens(renderer, Optics(focus_disparity=1.0, aperture_diameter=4.0))
    layer = RANDOM.random((SIZE[1], SIZE[0], 4)).astype(np.float32)
    targets.layers.sums.textures[1].write(layer.tobytes())

    def smoothed(width_px: float, drawn: int, wanted: int) -> NDArray[np.float32]:
        fill_tiles(targets, width_px, 0.0, wanted)
        passes.smooth(wide, targets, passes=drawn)
        return read(targets.layers.smooth.textures[0]).copy()

    np.testing.assert_allclose(smoothed(24.0, 9, 4), smoothed(12.0, 1, 1), atol=1e-5)
    np.testing.assert_allclose(smoothed(24.0, 4, 9), smoothed(12.0, 1, 1), atol=1e-5)


def half_size(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """The mean of every two by two pixels."""
    return image.reshape(image.shape[0] // 2, 2, image.shape[1] // 2, 2, -1).mean((1, 3))


@pytest.mark.parametrize("width_px", [3.0, 9.3, 40.0])
def test_smoothing_is_a_box_as_wide_as_told(
    renderer: Renderer, passes: Passes, targets: RenderTargets, width_px: float
) -> None:
    SCENE.fill(renderer, GRID)
    layers = [RANDOM.random((SIZE[1], SIZE[0], 4)).astype(np.float32) for _ in range(2)]
    for texture, layer in zip(targets.layers.sums.textures[1:], layers):
        texture.write(layer.tobytes())
    fill_tiles(targets, width_px, 0.0)
    passes.smooth(lens(renderer, Optics(focus_disparity=1.0, aperture_diameter=4.0)), targets, passes=1)
    reach = 0.25 * np.sqrt(max(width_px**2 - 11, 4.0))
    whole = int(np.ceil(reach - 0.5))
    taps = np.clip(reach + 0.5 - np.abs(np.arange(-whole, whole + 1)), 0, 1) / (2 * reach)
    expected = half_size(layers[0].astype(float))
    for axis in (1, 0):
        padded = np.pad(expected, [(whole, whole) if a == axis else (0, 0) for a in range(3)], mode="edge")
        expected = np.apply_along_axis(lambda line: np.convolve(line, taps, "valid"), axis, padded)
    smooth = [read(texture) for texture in targets.layers.smooth.textures]
    # Beyond the border a fetch is of its last pixels, not the mean of two by two.
    inner = np.s_[whole : -whole or None, whole : -whole or None]
    assert smooth[0][inner] == pytest.approx(expected[inner], abs=1e-4)
    assert np.isfinite(smooth[0]).all()
    assert not smooth[1].any(), "nothing is smoothed where tiles tell of nothing"


def fill_tiles(targets: RenderTargets, front_px: float, behind_px: float, passes: int = 1) -> None:
    """The same blur and as many passes all over."""
    tiles = np.zeros((SIZE[1] // TILE_PX, SIZE[0] // TILE_PX, 4), np.float32)
    tiles[..., :3] = front_px, behind_px, passes
    targets.wide_tiles.textures[0].write(tiles.tobytes())


@pytest.mark.parametrize("width_px", [0.0, 2.0, 5.0])
def test_layers_are_laid_over_each_other(
    renderer: Renderer, passes: Passes, targets: RenderTargets, width_px: float
) -> None:
    """Sharp background, covered by foreground: of two brightnesses where smoothed, of two others where not."""
    SCENE.fill(renderer, GRID)
    wide = replace(lens(renderer, Optics(focus_disparity=1.0, aperture_diameter=4.0)), exposure=1.0)
    assert wide.keeps_layers
    covered, bright = 0.5, {"raw": (0.3, 0.6), "smooth": (0.8, 0.1)}
    sharp = np.full((SIZE[1], SIZE[0], 4), (1 - covered) * np.array([0.2, 0.4, 0.6, 1.0]), "f4")
    foreground = {
        name: np.zeros((SIZE[1] // half, SIZE[0] // half, 4), "f4") for name, half in (("raw", 1), ("smooth", 2))
    }
    for name, layer in foreground.items():
        for side, value in zip(np.split(layer, 2, axis=1), bright[name]):
            side[:] = covered * np.array([value, value, value, 1.0])
    for texture, values in (
        (targets.light.textures[0], sharp),
        (targets.layers.sums.textures[1], foreground["raw"]),
        (targets.layers.sums.textures[2], np.zeros_like(foreground["raw"])),
        (targets.layers.smooth.textures[0], foreground["smooth"]),
        (targets.layers.smooth.textures[1], np.zeros_like(foreground["smooth"])),
    ):
        texture.write(values.tobytes())
    fill_tiles(targets, width_px, 0.0)
    targets.image.use()
    passes.present(wide, targets, passes=1, is_linear=False)
    renderer._screen.show(targets)
    image = renderer.read_image()
    smoothed = min(width_px**2 / 11, 1.0)
    for side, columns in enumerate((slice(0, 70), slice(90, 160))):
        shown = (1 - smoothed) * bright["raw"][side] + smoothed * bright["smooth"][side]
        expected = srgb_from_linear(0.5 * np.array([0.2, 0.4, 0.6]) + 0.5 * shown) * 255
        assert np.abs(image[:, columns] - expected).max() < 1


def test_outside_all_views_mirror_images_stand_in(renderer: Renderer) -> None:
    """Seen from far beside the grid, a flat scene goes on as its mirror image: no streaks."""
    scene = TwoPlanes(width=96, height=64, background=6.0, foreground=6.0)
    grid = GridShape(3, 3)
    scene.fill(renderer, grid)
    eye = ViewOffset(0.0, 3.0)
    renderer.render(Optics(eye), (96, 64))
    image = renderer.read_image()
    photo = scene.view(ViewOffset(0.0, 1.0))[0]
    moved = round(6.0 * (eye.s - 1.0))
    mirrored = np.concatenate([photo, photo[:, ::-1]], axis=1)[:, moved : moved + 96]
    assert rms(image, mirrored, border=2) < 0.01


def test_edits_of_the_optics_rebuild_nothing(renderer: Renderer) -> None:
    """No program, texture or view is made again: numbers change, and the picture is drawn."""
    SCENE.fill(renderer, GRID)
    first = Optics(ViewOffset(0.2, 0.1), focus_disparity=1.0, aperture_diameter=3.0)
    renderer.render(first, SIZE)
    before = len(renderer.programs), renderer.field, renderer.image_texture
    for edit in (
        replace(first, eye=CENTRE),
        replace(first, focus_disparity=-3.0),
        replace(first, aperture_diameter=4.5),
        replace(first, focus_tilt=(1.0, 0.5)),
        replace(first, exposure_stops=1.0),
    ):
        renderer.render(edit, SIZE)
        assert (len(renderer.programs), renderer.field, renderer.image_texture) == before, edit
