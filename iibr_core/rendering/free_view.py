"""A view of any camera from the ray set: turned, moved along all axes, with a lens of its own.

Dynamic reparameterisation (Isaksen et al. 2000) of two-plane rays, with a disparity for each ray in place of their one
focal surface. A ray (x, y) with disparity d is a point (x, y, 1, d) of disparity space, in which every camera is a 4x4
matrix. Forward, pixels land as squares that meet their neighbours on the same surface, and a z-test tells what each
sample of a target pixel sees; backward, every surface looks up its colour in its own source.
"""

from __future__ import annotations

from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.background import continue_farthest
from iibr_core.rendering.candidates import SEALED_GAP_PX
from iibr_core.rendering.joined_rays import BELOW, RIGHT
from iibr_core.rendering.ray_cells import CELL_PX
from iibr_core.rendering.ray_set import HIGHEST_LEVEL, OWN_SURFACE_PX, RaySet
from iibr_core.rendering.rendered_view import RenderedView
from iibr_core.rendering.resampling import SOLE, cubic, resample, resample_inpainted
from iibr_core.runtime.jit import kernel, linear_scalar, srgb_scalar
from iibr_core.runtime.tiling import MOST_BAND_PIXELS, ShouldStop, in_bands, never
from iibr_core.types import Camera, FloatImage, ImageSize, Margins

SAMPLES = 3
"""A target pixel has SAMPLES x SAMPLES of them; what lands on one covers it whole."""
COVERED_SAMPLES = 0.5
"""A pixel less of whose samples see anything is a hole."""
LEAST_DEPTH = 1e-3
"""Nearer to the camera, as a share of its distance from the photo's, nothing is drawn."""
MOST_MAGNIFIED_PX = 16.0
"""A square that lands larger than this is left out: the photo knows nothing so small."""
FINE_PX = 1.25
"""Where a target pixel spans more pixels of its source, every sample looks up its own colour: none may be skipped."""
SEALED_STEPS = 1.5
"""Surfaces of a rounded map are stairs; steps up to so many times its own are no depth edges."""
# The order in which a ray that fills its pixel in part covers samples: any share is spread over the pixel.
COVERING_ORDER = np.array([4, 0, 8, 2, 6, 1, 7, 3, 5]).argsort()
INSIDE = 1e-6
"""Samples on a side shared by two triangles belong to both."""
CORNERS = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)])
"""(y, x) of a pixel's corners, clockwise."""

Matrix = NDArray[np.float64]


def disparity_space(camera: Camera, scale_px: float) -> Matrix:
    """(4, 4): from (x, y, 1, d) of a camera's picture to its (X, Y, Z, 1) / Z, for a disparity d of scale_px / Z."""
    space = np.diag([1.0, 1.0, 1.0, 1 / scale_px])
    space[:3, :3] = np.linalg.inv(camera.intrinsics)
    return space


def target_from_photo(photo: Camera, target: Camera, scale_px: float) -> Matrix:
    """(4, 4): from (x, y, 1, d) of the photo to a multiple of the same of the target, whose third part is positive for
    what lies before the target's camera.
    """
    moved = np.eye(4)
    moved[:3, :3] = target.world_from_camera.T @ photo.world_from_camera
    moved[:3, 3] = target.world_from_camera.T @ (photo.position - target.position)
    return np.linalg.inv(disparity_space(target, scale_px)) @ moved @ disparity_space(photo, scale_px)


def render_free_view(
    rays: RaySet,
    target_from_rays: Matrix,
    size: ImageSize,
    frame: Margins,
    rounding_step: float = 0.0,
    should_stop: ShouldStop = never,
) -> RenderedView:
    """The view of a camera with pictures of a size, its holes filled.

    target_from_rays: see `target_from_photo`. frame: so far within the ray set's images the photo's own frame lies: all
    beyond counts as inpainted. rounding_step: what disparity is rounded to. Raises Cancelled once should_stop is true.
    """
    view = RenderedView(
        np.zeros((*size, 3), np.float32), np.zeros(size, np.float32), np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    )
    matrices = [target_from_rays @ _photo_from_source(offset) for offset in rays.arrays.offsets]
    drawing = [tuple(map(float, matrix.ravel())) for matrix in matrices]
    looking_up = np.stack([np.linalg.inv(matrix).ravel() for matrix in matrices])
    landing = [_landing(rays, k, matrix, should_stop) for k, matrix in enumerate(drawing)]
    surface, sealed_step = OWN_SURFACE_PX / rays.farthest_views, SEALED_STEPS * rounding_step

    def band(first: int, last: int) -> None:
        nearest, source = _draw(rays, drawing, landing, surface, sealed_step, (first, last), size.width)
        _resolve(
            rays.arrays, looking_up, frame, rays.farthest_views, first, nearest, source,
            view.colors, view.disparity, view.occluded, view.inpainted,
        )  # fmt: skip

    in_bands(band, size, should_stop, most_pixels=MOST_BAND_PIXELS // SAMPLES**2)
    if view.occluded.any():
        continue_farthest(view.colors, view.disparity, view.occluded, rays.farthest_views, should_stop, rays.stages)
    return view


def _photo_from_source(offset: NDArray[np.float64]) -> Matrix:
    """(4, 4): the view at an offset (t, s) sees at (x, y) what the photo shows at (x + d s, y + d t)."""
    matrix = np.eye(4)
    matrix[0, 3], matrix[1, 3] = offset[1], offset[0]
    return matrix


def _landing(rays: RaySet, k: int, matrix: tuple[float, ...], should_stop: ShouldStop) -> FloatImage:
    """(M, N, 2): the first and last target row that the rays in each cell of image k may land on, (inf, -inf) without
    rays.
    """
    cells = rays.cells
    landing = np.empty((*cells.low.shape[1:], 2), np.float32)
    size = ImageSize(*cells.low.shape[1:])
    in_bands(
        lambda first, last: _land_cells(cells.low[k], cells.high[k], matrix, first, last, landing), size, should_stop
    )
    return landing


def _draw(
    rays: RaySet,
    matrices: list[tuple[float, ...]],
    landing: list[FloatImage],
    surface: float,
    sealed_step: float,
    rows: tuple[int, int],
    width: int,
) -> tuple[FloatImage, NDArray[np.uint8]]:
    """What the samples of target rows [first, last) see, SAMPLES times as many rows and columns: the nearest disparity,
    and 1 + the index of its source, 0 where nothing landed.
    """
    first, last = rows
    shape = SAMPLES * (last - first), SAMPLES * width
    nearest, source = np.full(shape, -np.inf, np.float32), np.zeros(shape, np.uint8)
    apart = np.zeros_like(rays.joined)
    for k, matrix in enumerate(matrices):
        joined = rays.joined if k == 0 else apart
        # What the photo shows goes before what was made up beside it.
        ahead = surface if k >= rays.photo_images else 0.0
        _draw_rays(rays.arrays, k, joined, landing[k], matrix, ahead, sealed_step, first, nearest, source)
    return nearest, source


@kernel
def _project(m, x, y, d):
    """(x, y, d) by a matrix of 16 numbers: its (X, Y, D) and the factor they were divided by."""
    w = m[8] * x + m[9] * y + m[10] + m[11] * d
    return (
        (m[0] * x + m[1] * y + m[2] + m[3] * d) / w,
        (m[4] * x + m[5] * y + m[6] + m[7] * d) / w,
        (m[12] * x + m[13] * y + m[14] + m[15] * d) / w,
        w,
    )


@kernel
def _land_cells(low, high, m, first, last, landing):
    """`_landing` of rows [first, last) of cells: their boxes in disparity space stay convex."""
    rows, columns = low.shape
    for v in range(first, last):
        for u in range(columns):
            landing[v, u, 0], landing[v, u, 1] = np.inf, -np.inf
            if not low[v, u] <= high[v, u]:
                continue
            # Corners of pixels take part in the disparities of the cells around.
            least, most = low[v, u], high[v, u]
            for j in range(max(v - 1, 0), min(v + 2, rows)):
                for i in range(max(u - 1, 0), min(u + 2, columns)):
                    least, most = min(least, low[j, i]), max(most, high[j, i])
            for corner in range(8):
                x = CELL_PX * (u + (corner & 1)) - 0.5
                y = CELL_PX * (v + (corner >> 1 & 1)) - 0.5
                _, row, _, w = _project(m, x, y, most if corner & 4 else least)
                if not w > LEAST_DEPTH:  # it reaches behind the camera: anywhere
                    landing[v, u, 0], landing[v, u, 1] = -np.inf, np.inf
                    break
                landing[v, u, 0], landing[v, u, 1] = min(landing[v, u, 0], row), max(landing[v, u, 1], row)


@kernel
def _draw_rays(rays, index, joined, landing, m, ahead, sealed_step, first_row, nearest, source):
    """Draw the rays of one image; see `_draw`. ahead: so much nearer than the photo's surface it must
    be to hide it.
    """
    disparity, coverage = rays.disparity[index], rays.coverage[index]
    height, width = disparity.shape
    last_row = first_row + len(nearest) // SAMPLES - 1
    corners, is_drawn = np.empty((width, 4, 3)), np.empty(width, np.bool_)
    for y in range(height):
        any_drawn = False
        for x in range(width):
            v, u = y // CELL_PX, x // CELL_PX
            is_near = landing[v, u, 1] >= first_row - 1 and landing[v, u, 0] <= last_row + 1
            is_drawn[x] = is_near and coverage[y, x] > 0
            any_drawn = any_drawn or is_drawn[x]
        if any_drawn:
            _land_squares(disparity, joined, m, y, sealed_step, corners, is_drawn)
            _draw_squares(corners, is_drawn, coverage[y], index, rays.photo_images, ahead, first_row, nearest, source)


@kernel
def _land_squares(disparity, joined, m, y, sealed_step, corners, is_drawn):
    """Where the corners of a row of pixels land: (X, Y, D) each; what reaches behind the camera is not drawn.

    A corner's disparity is the mean of those around it on the pixel's surface: where these agree, there are no cracks.
    """
    height, width = disparity.shape
    for x in range(width):
        if not is_drawn[x]:
            continue
        here = disparity[y, x]
        # Steps of disparity that open a gap as wide as may be sealed, or that rounding has left.
        at_x, at_y, _, _ = _project(m, x, y, here)
        wide = max(abs(m[0] - at_x * m[8]), abs(m[5] - at_y * m[9]), abs(m[1] - at_x * m[9]), abs(m[4] - at_y * m[8]))
        one_surface = SEALED_GAP_PX * wide / max(abs(m[3] - at_x * m[11]), abs(m[7] - at_y * m[11]), 1e-9)
        one_surface = max(one_surface, sealed_step)
        for corner in range(4):
            v, u = y + CORNERS[corner, 0], x + CORNERS[corner, 1]
            has_row, has_column = 0 <= v < height, 0 <= u < width
            total, count, top, left = np.float64(here), 1, min(y, v), min(x, u)
            is_across = is_along = False
            if has_column and (abs(disparity[y, u] - here) <= one_surface or joined[y, left] & RIGHT):
                is_across, total, count = True, total + disparity[y, u], count + 1
            if has_row and (abs(disparity[v, x] - here) <= one_surface or joined[top, x] & BELOW):
                is_along, total, count = True, total + disparity[v, x], count + 1
            if has_row and has_column:
                down, right = abs(disparity[v, u] - disparity[y, u]), abs(disparity[v, u] - disparity[v, x])
                by_way_of_row = is_across and (down <= one_surface or joined[top, u] & BELOW)
                if by_way_of_row or (is_along and (right <= one_surface or joined[v, left] & RIGHT)):
                    total, count = total + disparity[v, u], count + 1
            at_x, at_y, d, w = _project(m, 0.5 * (x + u), 0.5 * (y + v), total / count)
            corners[x, corner, 0], corners[x, corner, 1], corners[x, corner, 2] = at_x, at_y, d
            is_drawn[x] = is_drawn[x] and w > LEAST_DEPTH


@kernel
def _draw_squares(corners, is_drawn, coverage, index, photo_images, ahead, first_row, nearest, source):
    """Draw pixels whose corners landed so, two triangles each: disparity is linear over planes."""
    rows, columns = nearest.shape
    for x in range(len(corners)):
        if not is_drawn[x]:
            continue
        filled = coverage[x] * SAMPLES**2
        x0, y0, d0 = corners[x, 0, 0], corners[x, 0, 1], corners[x, 0, 2]
        for b in range(1, 3):
            x1, y1, d1 = corners[x, b, 0] - x0, corners[x, b, 1] - y0, corners[x, b, 2] - d0
            x2, y2, d2 = corners[x, b + 1, 0] - x0, corners[x, b + 1, 1] - y0, corners[x, b + 1, 2] - d0
            area = x1 * y2 - x2 * y1
            left, right = x0 + min(0.0, x1, x2), x0 + max(0.0, x1, x2)
            top, bottom = y0 + min(0.0, y1, y2) - first_row, y0 + max(0.0, y1, y2) - first_row
            # Seen from behind, not finite, or too large.
            if not (area > 1e-9 and right - left <= MOST_MAGNIFIED_PX and bottom - top <= MOST_MAGNIFIED_PX):
                continue
            if not (right > -0.5 and left * SAMPLES < columns and bottom > -0.5 and top * SAMPLES < rows):
                continue
            first_v, last_v = max(_sample_after(top), 0), min(_sample_after(bottom), rows - 1)
            first_u, last_u = max(_sample_after(left), 0), min(_sample_after(right), columns - 1)
            for v in range(first_v, last_v + 1):
                down = (v + 0.5) / SAMPLES - 0.5 + first_row - y0
                for u in range(first_u, last_u + 1):
                    across = (u + 0.5) / SAMPLES - 0.5 - x0
                    # Barycentric: the shares of the second and the third corner.
                    of_b, of_c = (across * y2 - x2 * down) / area, (x1 * down - across * y1) / area
                    if not (of_b >= -INSIDE and of_c >= -INSIDE and of_b + of_c <= 1.0 + INSIDE):
                        continue
                    if filled <= COVERING_ORDER[v % SAMPLES * SAMPLES + u % SAMPLES] + 0.5:
                        continue
                    d = np.float32(d0 + of_b * d1 + of_c * d2)
                    if d > nearest[v, u] + (ahead if 0 < source[v, u] <= photo_images else 0.0):
                        nearest[v, u], source[v, u] = d, index + 1


@kernel
def _sample_after(position):
    """The first sample at a position of the target, or after it."""
    return ceil((position + 0.5) * SAMPLES - 0.5)


@kernel
def _resolve(
    rays, inverses, frame, farthest_views, first_row, nearest, seen, colors, disparity, occluded, inpainted
):  # fmt: skip
    """The target rows that the samples are of: colours, disparity, holes, and what the photo shows nothing of."""
    images, surfaces, edge_level, photo_images = rays.colors, rays.disparity, rays.edge_level, rays.photo_images
    _, height, width = surfaces.shape
    top, bottom, left, right = frame
    is_taken = np.empty(SAMPLES**2, np.bool_)
    for row in range(nearest.shape[0] // SAMPLES):
        y = first_row + row
        for x in range(nearest.shape[1] // SAMPLES):
            landed = 0
            for sample in range(SAMPLES**2):
                v, u = row * SAMPLES + sample // SAMPLES, x * SAMPLES + sample % SAMPLES
                is_taken[sample] = seen[v, u] == 0
                landed += not is_taken[sample]
            if landed < COVERED_SAMPLES * SAMPLES**2:
                occluded[y, x] = inpainted[y, x] = True
                continue
            sum_r = sum_g = sum_b = 0.0
            most = 0
            for sample in range(SAMPLES**2):
                if is_taken[sample]:
                    continue
                v, u = row * SAMPLES + sample // SAMPLES, x * SAMPLES + sample % SAMPLES
                k, d = np.int64(seen[v, u]) - 1, np.float64(nearest[v, u])
                m = inverses[k]
                # How many pixels of the source a target pixel spans there, and disparity moves the look-up by.
                at_x, at_y, at_d, w = _project(m, x, y, d)
                spans_x = max(abs(m[0] - at_x * m[8]), abs(m[1] - at_x * m[9])) / abs(w)
                spans_y = max(abs(m[4] - at_y * m[8]), abs(m[5] - at_y * m[9])) / abs(w)
                is_fine = max(spans_x, spans_y) > FINE_PX
                moves = max(abs(m[3] - at_x * m[11]), abs(m[7] - at_y * m[11]), 1e-9)
                one_surface = OWN_SURFACE_PX * abs(w) / moves
                parallax = moves / max(abs(m[15] - at_d * m[11]), 1e-9)
                limit = min(max(farthest_views / parallax, 1.0), HIGHEST_LEVEL - 1.0)
                # The samples of its surface: their mean place and disparity lie on it.
                count, total_d, total_x, total_y = 0, 0.0, 0.0, 0.0
                for other in range(sample, SAMPLES**2):
                    j, i = other // SAMPLES, other % SAMPLES
                    v, u = row * SAMPLES + j, x * SAMPLES + i
                    if is_taken[other] or seen[v, u] != k + 1 or abs(nearest[v, u] - d) > one_surface:
                        continue
                    is_taken[other] = True
                    count, total_d = count + 1, total_d + nearest[v, u]
                    total_x, total_y = total_x + (i + 0.5) / SAMPLES - 0.5, total_y + (j + 0.5) / SAMPLES - 0.5
                    if is_fine:
                        break
                # Backward warp.
                mean_d, target_x, target_y = total_d / count, x + total_x / count, y + total_y / count
                at_x, at_y, at_d, _ = _project(m, target_x, target_y, mean_d)
                at_x, at_y = min(max(at_x, -0.5), width - 0.5), min(max(at_y, -0.5), height - 0.5)
                if edge_level[k, max(floor(at_y), 0), max(floor(at_x), 0)] <= limit:
                    r, g, b = cubic(images, k, at_x, at_y)
                elif k < photo_images:
                    r, g, b = resample(images, surfaces, k, at_x, at_y, at_d, parallax)
                else:
                    r, g, b = resample_inpainted(images, surfaces, k, at_x, at_y, at_d, parallax)
                if count > most:
                    most, disparity[y, x] = count, mean_d
                    is_within = left - 0.5 <= at_x <= width - right - 0.5 and top - 0.5 <= at_y <= height - bottom - 0.5
                    inpainted[y, x] = k >= photo_images or not is_within
                # A sole surface stays encoded; several are averaged in linear light, as their light adds up.
                if count >= SOLE * landed:
                    colors[y, x, 0], colors[y, x, 1], colors[y, x, 2] = max(r, 0.0), max(g, 0.0), max(b, 0.0)
                else:
                    sum_r += count * linear_scalar(r) / landed
                    sum_g += count * linear_scalar(g) / landed
                    sum_b += count * linear_scalar(b) / landed
            if most < landed:
                colors[y, x, 0], colors[y, x, 1], colors[y, x, 2] = (
                    srgb_scalar(sum_r), srgb_scalar(sum_g), srgb_scalar(sum_b),
                )  # fmt: skip
