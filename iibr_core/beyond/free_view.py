"""A view of any camera from the ray set: turned, moved along all axes, with a lens of its own.

Dynamic reparameterisation (Isaksen et al. 2000) of two-plane rays, with a disparity for each ray instead of one focal
surface. A ray (x, y) with disparity d is a point (x, y, 1, d) of disparity space, in which every camera is a 4x4
matrix. Forward, pixels land as squares that meet their neighbours on the same surface, and a z-test decides which one
each sample of a target pixel sees; backward, every surface looks up its colour in its own source.
"""

from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.landed_squares import SAMPLES, draw_rays, project, rows_landed_on
from iibr_core.inpainting.background import fill_background
from iibr_core.method.look_up import MIN_SOLE_SHARE, cubic, cubic_on_surface
from iibr_core.method.rays import RaySet
from iibr_core.method.view import View
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar, srgb_scalar
from iibr_core.runtime.tiling import MAX_PIXELS_AT_ONCE, in_bands
from iibr_core.surfaces import SAME_SURFACE_PX, same_surface, step_of
from iibr_core.types import CENTRE, Camera, ImageSize, Margins

COVERED_SAMPLES = 0.5
"""Share of a pixel's samples that see a surface below which the pixel is a hole."""
WIDE_FOOTPRINT_PX = 1.25
"""Number of source pixels across a target pixel above which every sample looks up a colour, so that none is skipped."""
SEALED_STEPS = 1.5
"""Largest step between pixels of one surface of a rounded map, as a multiple of the step it is rounded to."""

Matrix = NDArray[np.float64]


def disparity_space(camera: Camera, scale_px: float) -> Matrix:
    """Return the matrix from (x, y, 1, d) of a camera's picture to its (X, Y, Z, 1) / Z, where d is scale_px / Z."""
    space = np.diag([1.0, 1.0, 1.0, 1 / scale_px])
    space[:3, :3] = np.linalg.inv(camera.intrinsics)
    return space


def target_from_photo(photo: Camera, target: Camera, scale_px: float) -> Matrix:
    """Return the matrix from (x, y, 1, d) of the photo to a multiple of the same of the target.

    The third component is positive in front of the target's camera.
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
) -> View:
    """Return the view of a camera with pictures of this size, its holes filled.

    target_from_rays: see `target_from_photo`. frame: margins of the ray set's images around the photo's frame, which
    count as inpainted. rounding_step: step that disparity is rounded to.
    """
    hole, inpainted = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    view = View(np.zeros((*size, 3), np.float32), np.zeros(size, np.float32), hole, inpainted)
    matrices = [target_from_rays @ _photo_from_source(offset) for offset in rays.arrays.offsets]
    drawing = [tuple(map(float, matrix.ravel())) for matrix in matrices]
    inverses = np.stack([np.linalg.inv(matrix).ravel() for matrix in matrices])
    landing = [rows_landed_on(rays, k, matrix) for k, matrix in enumerate(matrices)]
    surface, sealed_step = step_of(SAME_SURFACE_PX, rays.farthest_views), SEALED_STEPS * rounding_step

    def band(first: int, last: int) -> None:
        nearest, source = draw_rays(rays, drawing, landing, surface, sealed_step, (first, last), size.width)
        _resolve(
            rays.arrays, inverses, frame, first, nearest, source,
            view.colors, view.disparity, view.occluded, view.inpainted,
        )  # fmt: skip

    in_bands(band, size, most_pixels=MAX_PIXELS_AT_ONCE // SAMPLES**2)
    if view.occluded.any():
        # Nothing is known to hide what lies behind, so the farthest surface around continues.
        nothing_hides = np.full(size, -np.inf, np.float32)
        fill_background(
            view.colors, view.disparity, view.occluded, nothing_hides, CENTRE,
            stages=rays.stages, farthest_views=rays.farthest_views,
        )  # fmt: skip
    return view


def _photo_from_source(offset: NDArray[np.float64]) -> Matrix:
    """Return the matrix from the view at an offset (t, s) to the photo, which moves (x, y) to (x + d s, y + d t)."""
    matrix = np.eye(4)
    matrix[0, 3], matrix[1, 3] = offset[1], offset[0]
    return matrix


@kernel
def _scales_at(m, x, y, d):
    """Return scales of the look-up for a target pixel.

    They are: whether it spans many source pixels, the largest step of disparity on one surface, and the number of
    pixels by which disparity moves the look-up.
    """
    at_x, at_y, at_d, w = project(m, x, y, d)
    spans_x = max(abs(m[0] - at_x * m[8]), abs(m[1] - at_x * m[9])) / abs(w)
    spans_y = max(abs(m[4] - at_y * m[8]), abs(m[5] - at_y * m[9])) / abs(w)
    moves = max(abs(m[3] - at_x * m[11]), abs(m[7] - at_y * m[11]), 1e-9)
    parallax = moves / max(abs(m[15] - at_d * m[11]), 1e-9)
    return max(spans_x, spans_y) > WIDE_FOOTPRINT_PX, SAME_SURFACE_PX * abs(w) / moves, parallax


@kernel
def _resolve(rays, inverses, frame, first_row, nearest, seen, colors, disparity, occluded, inpainted):
    """Write the target rows of these samples: colours, disparity, holes, and pixels that the photo does not show."""
    images, surfaces, near_edge, photo_images = rays.colors, rays.disparity, rays.near_edge, rays.photo_images
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
                is_fine, one_surface, parallax = _scales_at(m, x, y, d)
                # The mean position and disparity of the samples of its surface lie on it.
                count, total_d, total_x, total_y = 0, 0.0, 0.0, 0.0
                for other in range(sample, SAMPLES**2):
                    j, i = other // SAMPLES, other % SAMPLES
                    v, u = row * SAMPLES + j, x * SAMPLES + i
                    if is_taken[other] or seen[v, u] != k + 1 or not same_surface(nearest[v, u], d, one_surface):
                        continue
                    is_taken[other] = True
                    count, total_d = count + 1, total_d + nearest[v, u]
                    total_x, total_y = total_x + (i + 0.5) / SAMPLES - 0.5, total_y + (j + 0.5) / SAMPLES - 0.5
                    if is_fine:
                        break
                mean_d = total_d / count
                at_x, at_y, at_d, _ = project(m, x + total_x / count, y + total_y / count, mean_d)
                at_x, at_y = min(max(at_x, -0.5), width - 0.5), min(max(at_y, -0.5), height - 0.5)
                if not near_edge[k, max(floor(at_y), 0), max(floor(at_x), 0)]:
                    r, g, b = cubic(images, k, at_x, at_y)
                else:
                    r, g, b = cubic_on_surface(images, surfaces, k, at_x, at_y, at_d, parallax)
                if count > most:
                    most, disparity[y, x] = count, mean_d
                    is_within = left - 0.5 <= at_x <= width - right - 0.5 and top - 0.5 <= at_y <= height - bottom - 0.5
                    inpainted[y, x] = k >= photo_images or not is_within
                # A sole surface stays encoded; the linear light of several adds up.
                if count >= MIN_SOLE_SHARE * landed:
                    colors[y, x, 0], colors[y, x, 1], colors[y, x, 2] = max(r, 0.0), max(g, 0.0), max(b, 0.0)
                else:
                    sum_r += count * linear_scalar(r) / landed
                    sum_g += count * linear_scalar(g) / landed
                    sum_b += count * linear_scalar(b) / landed
            if most < landed:
                colors[y, x, 0], colors[y, x, 1], colors[y, x, 2] = (
                    srgb_scalar(sum_r), srgb_scalar(sum_g), srgb_scalar(sum_b),
                )  # fmt: skip
