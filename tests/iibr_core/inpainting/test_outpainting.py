import numpy as np

from iibr_core.inpainting.outpainting import (
    ANGLE_POWER,
    LINE_NOISE,
    LINE_REACH_PX,
    PLACES,
    SLANT,
    STRENGTH_POWER,
    TEXTURE_PX,
    TEXTURE_SHARE,
    _level,
    outpaint,
)
from iibr_core.method.farthest_views import outer_views_of_grid, outpainting_margins
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.types import GridShape, ImageSize, Margins, ViewOffset
from tests.iibr_core.scenes import smooth_texture

SIZE = ImageSize(16, 24)
MARGINS = Margins(2, 5, 3, 4)


def noise(height, width):
    return np.random.default_rng(3).random((height, width, 3), np.float32)


def mean_at(means, level, place):
    k = int(level)
    return means[k][place] * (k + 1 - level) + means[k + 1][place] * (level - k)


def line_slowly(colors, pixel):
    """Return (cos 2a, sin 2a) of the way a line runs at a pixel, of length 1 if nothing else does."""
    tensor = np.zeros((2, 2))
    for v, u in np.ndindex(colors.shape[0] - 1, colors.shape[1] - 1):
        if max(abs(v - pixel[0]), abs(u - pixel[1])) <= LINE_REACH_PX:
            square = colors[v : v + 2, u : u + 2].astype(float)
            steps = np.stack([np.diff(square, axis=1).mean((0, 1)), np.diff(square, axis=0).mean((0, 1))])
            tensor += steps @ steps.T
    (least, most), axes = np.linalg.eigh(tensor)
    angle = np.arctan2(axes[1, 0], axes[0, 0])
    strength = (most - least) / (least + most + 3 * (2 * LINE_REACH_PX + 1) ** 2 * LINE_NOISE**2)
    return strength * np.array([np.cos(2 * angle), np.sin(2 * angle)])


def along_line(line, way):
    angle = np.arctan2(way[1], way[0]) - np.arctan2(line[1], line[0]) / 2
    return np.hypot(*line) ** STRENGTH_POWER * np.cos(angle) ** ANGLE_POWER


def extend_slowly(colors, disparity, margins):
    height, width = disparity.shape
    places = [(0, x) for x in range(width)] + [(y, width - 1) for y in range(1, height)]
    places += [(height - 1, x) for x in range(width - 2, -1, -1)] + [(y, 0) for y in range(height - 2, 0, -1)]
    means = [np.array([colors[at] for at in places], np.float64)]
    for k in range(12):
        last = means[-1]
        means.append(last / 2 + np.roll(last, 2**k, 0) / 4 + np.roll(last, -(2**k), 0) / 4)
    lines = [line_slowly(colors, at) for at in places]
    kernel = np.outer([1, 4, 6, 4, 1], [1, 4, 6, 4, 1]) / 256
    around = np.pad(colors, ((2, 2), (2, 2), (0, 0)), "edge").astype(np.float64)
    grown = np.empty((*margins.around(SIZE), 3))
    surfaces = np.empty(margins.around(SIZE))
    for row, column in np.ndindex(surfaces.shape):
        y, x = np.clip(row - margins.top, 0, height - 1), np.clip(column - margins.left, 0, width - 1)
        away = np.hypot(row - margins.top - y, column - margins.left - x)
        if not away:
            surfaces[row, column], grown[row, column] = disparity[y, x], colors[y, x]
            continue
        nearest = places.index((y, x))
        surfaces[row, column] = disparity[y, x]
        mean = mean_at(means, _level(away), nearest)
        v, u = 2 * y - row + margins.top, 2 * x - column + margins.left
        detail = colors[v, u] - np.einsum("ij,ijc->c", kernel, around[v : v + 5, u : u + 5])
        colour = np.maximum(mean + TEXTURE_SHARE * away / (away + TEXTURE_PX) * detail, 0)
        total, step = 1.0, SLANT * away / PLACES
        for j in range(-PLACES, PLACES + 1):
            n = int(np.floor(nearest + j * step + 0.5)) % len(places)
            way = column - margins.left - places[n][1], row - margins.top - places[n][0]
            weight = along_line(lines[n], way) * away / np.hypot(*way)
            total, colour = total + weight, colour + weight * mean_at(means, _level(step), n)
        grown[row, column] = colour / total
    return grown, surfaces


def test_against_the_definitions():
    colors, disparity = noise(*SIZE), noise(*SIZE)[..., 0]
    for found, expected in zip(outpaint(colors, disparity, MARGINS), extend_slowly(colors, disparity, MARGINS)):
        np.testing.assert_allclose(found, expected, atol=2e-6)


def textured_wall(disparity):
    """Return the complete ray set of a wall that moves as a whole, for a grid of 5 x 5 views."""
    values = np.full((40, 44), disparity, np.float32)
    outer = outer_views_of_grid(GridShape(5, 5))
    rays = rays_of_photo(smooth_texture(40, 44), values, 2.0, 8, margins=outpainting_margins(values, outer))
    list(update(rays, outer, Renderer()))
    return rays


def test_views_agree_beyond_the_frame_and_say_that_it_is_inpainted():
    rays = textured_wall(3.0)
    corner, half, photo = (Renderer().render(rays, ViewOffset(at, at)) for at in (2.0, 1.0, 0.0))
    np.testing.assert_array_equal(photo.colors, smooth_texture(40, 44))
    assert not photo.inpainted.any()
    assert not corner.occluded.any()
    expected = np.ones((40, 44), np.bool_)
    expected[:34, :38] = False
    np.testing.assert_array_equal(corner.inpainted, expected)
    # The same content, three pixels on.
    np.testing.assert_allclose(corner.colors[:-3, :-3], half.colors[3:, 3:], atol=1e-5)


def test_what_moves_farther_than_the_margins_reach_is_filled_by_the_views():
    rays = textured_wall(20.0)
    assert rays.margins == (10, 10, 11, 11)
    view = Renderer().render(rays, ViewOffset(2.0, 2.0))
    assert np.isfinite(view.colors).all()
    assert view.inpainted.all()
