"""One view from the ray set (paper, section 3.3): candidates, weights, colours, mask, and what is inpainted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.inpainting.background import continues_in_front, fill_background
from iibr_core.inpainting.registry import Inpainter
from iibr_core.method.ambiguous_rays import SEARCH_PX, AmbiguousRays, blend, find_ambiguous_rays
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.flying_pixels import without_flying_pixels
from iibr_core.method.look_up import look_up
from iibr_core.method.occlusion import FULLY_COVERED, MIN_COVERED, MOSTLY_COVERED
from iibr_core.method.rays import NO_MARGINS, RaysBehind, RaySet
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage, Margins, StoredColors, ViewOffset

Transformer = Callable[[AmbiguousRays], FloatImage]
"""Function that returns the weights (N, K) of ambiguous rays; rows sum to 1."""


@dataclass(frozen=True, eq=False)
class View:
    """A view without holes.

    colors (H, W, 3): sRGB-encoded. disparity (H, W). occluded (H, W): True where no source showed anything, so that it
    was inpainted here. inpainted (H, W): True where the photo showed nothing: inpainted here or in an earlier view.
    behind: what was inpainted here behind something that covers it in part, None without any.
    """

    colors: FloatImage
    disparity: FloatImage
    occluded: NDArray[np.bool_]
    inpainted: NDArray[np.bool_]
    behind: RaysBehind | None = None


@dataclass(frozen=True)
class Renderer:
    """Renders views. transformer: decides ambiguous rays, None for the closed form. inpaint: fills what is occluded."""

    transformer: Transformer | None = None
    inpaint: Inpainter = fill_background

    def render(self, rays: RaySet, offset: ViewOffset, threads: int = 1, reopens: bool = False) -> View:
        """Return the view at `offset`.

        threads: number of row bands side by side; it does not change the result. reopens: whether what other views
        inpainted is inpainted again here where it shows through a hole in one of the photo's surfaces.
        """
        view, covered = self.visible(rays, offset, threads)
        view = self._fill(rays, offset, view, covered, threads, reopens)
        if any(rays.margins):
            _mark_outside_frame(view.disparity, *map(float, offset), view.inpainted)
        return view

    def visible(self, rays: RaySet, offset: ViewOffset, threads: int = 1) -> tuple[View, FloatImage]:
        """Return the view at `offset` with open holes, and how much of each ray is covered (H, W)."""
        size = rays.view_size
        view = View(
            np.empty((*size, 3), np.float32),
            np.empty(size, np.float32),
            np.empty(size, np.bool_),
            np.empty(size, np.bool_),
        )
        covered = np.empty(size, np.float32)

        def band(first: int, last: int) -> None:
            self._render_rows(rays, offset, (first, last), view, covered)

        in_bands(band, size, threads)
        return view, covered

    def _render_rows(
        self, rays: RaySet, offset: ViewOffset, rows: tuple[int, int], view: View, covered: FloatImage
    ) -> None:
        """Write rows [first, last) of the view, holes open, and of how much of each ray is covered."""
        around = SEARCH_PX if self.transformer else 0
        # The images are larger than the view: their rows and columns count here.
        first, last = rows[0] + rays.margins.top, rows[1] + rays.margins.top
        left, right = rays.margins.left, rays.size.width - rays.margins.right
        above = min(first, around)
        columns = max(left - around, 0), min(right + around, rays.size.width)
        candidates = find_candidates(rays, offset, (first - above, min(last + around, rays.size.height)), columns)
        raise_if_stopped()
        weights, share = closed_form(candidates)
        inner, shown = (slice(above, above + last - first), slice(left, right)), slice(*rows)
        wanted = np.zeros(share.shape, np.bool_)
        wanted[inner] = True
        found = look_up(rays, candidates, weights, wanted, (view.colors[shown], above, left))
        raise_if_stopped()
        view.disparity[shown], covered[shown] = found.disparity[inner], share[inner]
        view.occluded[shown] = share[inner] < MIN_COVERED
        view.inpainted[shown] = view.occluded[shown] | (found.source[inner] >= rays.photo_images)
        if not self.transformer:
            return
        # Rays that are covered in part are composited over their background, not decided.
        asked = wanted & (share >= max(_min_coverage(rays), MIN_COVERED))
        ambiguous = find_ambiguous_rays(rays, candidates, weights, found, asked)
        raise_if_stopped()
        colors, disparity, source = blend(rays, ambiguous, self.transformer(ambiguous))
        at = ambiguous.pixel[:, 0] - rays.margins.top, ambiguous.pixel[:, 1] - left
        view.colors[at], view.disparity[at], view.inpainted[at] = colors, disparity, source >= rays.photo_images

    def _fill(
        self, rays: RaySet, offset: ViewOffset, view: View, covered: FloatImage, threads: int, reopens: bool
    ) -> View:
        """Return the view with its holes filled.

        covered (H, W): what covers a ray in part is composited over what is inpainted there. So no pixel that two
        surfaces share is a seed for inpainting, either.
        """
        colors, disparity = view.colors.reshape(-1, 3), view.disparity.reshape(-1)
        part = np.flatnonzero((covered < _min_coverage(rays)) & (covered > 0))
        part = part[_is_within(rays, rays.margins, part, disparity[part], offset) | view.occluded.reshape(-1)[part]]
        hole = view.occluded.copy()
        hole.reshape(-1)[part] = True
        if reopens and rays.stages.reopen_holes:
            hole |= _reopened(rays, offset, view, hole, threads)
        if not hole.any():
            return view
        foreground, foreground_disparity = colors[part], disparity[part]
        self.inpaint(view.colors, view.disparity, hole, rays.photo_disparity, offset, threads)
        if not len(part):
            return view
        behind, share = RaysBehind(part, colors[part], disparity[part]), covered.reshape(-1)[part]
        colors[part] = _composite(foreground, behind.colors, share)
        disparity[part] = np.where(share > MOSTLY_COVERED, foreground_disparity, behind.disparity)
        view.inpainted.reshape(-1)[part] |= share <= MOSTLY_COVERED
        return replace(view, behind=behind)


def _reopened(rays: RaySet, offset: ViewOffset, view: View, hole: NDArray[np.bool_], threads: int) -> NDArray[np.bool_]:
    """Return where inpainted rays of another view show although the photo's surfaces go on in front of them (H, W).

    They lie farther back, behind another part of the surface. These pixels count as occluded from now on.
    """
    pixel, reopened = np.flatnonzero(view.inpainted & ~hole), np.zeros_like(hole)
    within = _is_within(rays, NO_MARGINS, pixel, view.disparity.reshape(-1)[pixel], offset)
    reopened.reshape(-1)[pixel[within]] = True
    if reopened.any():
        reopened &= continues_in_front(view.disparity, hole | reopened, rays.photo_disparity, offset, threads)
        view.occluded[reopened] = True
    return reopened


def finish(rays: RaySet, offset: ViewOffset, view: View, threads: int | None = 1) -> View:
    """Return a view made of the rays of a photo without its flying pixels."""
    return replace(view, colors=finished_colors(rays, offset, view, view.colors, threads))


def finished_colors(
    rays: RaySet, offset: ViewOffset, view: View, colors: StoredColors | FloatImage, threads: int | None = 1
) -> NDArray[Any]:
    """Return the colours (H, W, 3) of a view, encoded or stored, without its flying pixels."""
    if not rays.stages.remove_flying_pixels:
        return colors
    detail, margins = rays.photo_detail, rays.margins
    return without_flying_pixels(colors, view.disparity, view.inpainted, detail, offset, margins, threads)


def _min_coverage(rays: RaySet) -> float:
    """Return the share below which a ray is composited over the inpainted background."""
    return FULLY_COVERED if rays.stages.composite_partial_coverage else 0.0


def _is_within(
    rays: RaySet, margins: Margins, pixel: NDArray[np.int64], disparity: FloatImage, offset: ViewOffset
) -> NDArray[np.bool_]:
    """Return which of these pixels (N) of a view look between the outermost rays of the photo with such margins."""
    height, width = rays.view_size
    y, x = np.divmod(pixel, width)
    y, x = y + disparity * offset.t, x + disparity * offset.s
    inside = (y >= -margins.top) & (y <= height - 1 + margins.bottom)
    return np.asarray(inside & (x >= -margins.left) & (x <= width - 1 + margins.right))


@kernel
def _mark_outside_frame(disparity, t, s, inpainted):
    """Mark the pixels of a view that look beyond the photo's frame in inpainted (H, W)."""
    height, width = disparity.shape
    for y in range(height):
        for x in range(width):
            v, u = y + disparity[y, x] * t, x + disparity[y, x] * s
            # Without branches: rows are compared many at a time.
            inpainted[y, x] |= (v < -0.5) | (v > height - 0.5) | (u < -0.5) | (u > width - 0.5)


def _composite(foreground: FloatImage, background: FloatImage, share: FloatImage) -> FloatImage:
    """Return colours (N, 3) of a foreground that covers these shares (N), over a background, in linear light."""
    light = linear_from_srgb(background) + share[:, None] * (
        linear_from_srgb(foreground) - linear_from_srgb(background)
    )
    return np.asarray(srgb_from_linear(light), np.float32)
