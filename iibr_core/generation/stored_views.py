"""Views of one ray set as a light field stores them: final at once, or as drafts that are finished later.

A draft keeps its view and, of each ray that the transformer is still to be asked for, what that needs: nothing else is
made again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import stored_from_encoded
from iibr_core.rendering.ambiguous_rays import UndecidedRays
from iibr_core.rendering.flying_pixels import without_flying_pixels
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.rendered_view import RenderedView
from iibr_core.rendering.renderer import Renderer
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, GridShape, StoredColors, ViewOffset, ViewUpdate, image_size


@dataclass(frozen=True, eq=False)
class Draft:
    """A view in closed form, and its rays that the transformer is still to be asked for: see `Renderer`.

    with_flying_pixels: its colours, stored, before its flying pixels were replaced.
    """

    update: ViewUpdate
    with_flying_pixels: StoredColors
    undecided: list[UndecidedRays]

    @property
    def nbytes(self) -> int:
        """Memory it takes."""
        view = (self.update.colors, self.with_flying_pixels, self.update.disparity, self.update.inpainted)
        return sum(part.nbytes for part in view if part is not None) + sum(part.nbytes for part in self.undecided)


class StoredViews:
    """Makes views of one ray set as they are handed over, each in the thread that asks."""

    def __init__(self, renderer: Renderer, rays: RaySet, grid: GridShape, is_hdr: bool) -> None:
        self._renderer, self._rays, self._grid = renderer, rays, grid
        self._is_hdr = is_hdr

    def make(self, offset: ViewOffset) -> ViewUpdate:
        """A final view."""
        return self.update(offset, self._renderer.render(self._rays, offset, alone=True))

    def draft(self, offset: ViewOffset) -> Draft:
        """A view in closed form, final where nothing is left to be decided."""
        view, undecided = self._renderer.draft(self._rays, offset)
        stored = encode_for_storage(view.colors, self._is_hdr, 1)
        colors = self._without_flying_pixels(offset, stored, view.disparity, view.inpainted)
        update = self._update(offset, colors, view.disparity, view.inpainted, not undecided)
        return Draft(update, stored, undecided)

    def finish(self, draft: Draft) -> ViewUpdate:
        """The final view: its undecided rays are written over, the draft itself stays as it is."""
        assert draft.update.disparity is not None
        assert draft.update.inpainted is not None
        stored, disparity = draft.with_flying_pixels.copy(), draft.update.disparity.copy()
        inpainted = draft.update.inpainted.copy()
        for part in draft.undecided:
            decided = self._renderer.decide(self._rays, part)
            at = np.unravel_index(decided.pixel, self._rays.view_size)
            stored[at] = stored_from_encoded(decided.colors, self._is_hdr)
            disparity[at], inpainted[at] = decided.disparity, decided.inpainted
        offset = self._grid.offset(draft.update.row, draft.update.column)
        colors = self._without_flying_pixels(offset, stored, disparity, inpainted)
        return self._update(offset, colors, disparity, inpainted, True)

    def update(self, offset: ViewOffset, view: RenderedView, is_final: bool = True) -> ViewUpdate:
        """A rendered view as it is stored."""
        colors = stored_colors(self._rays, offset, view, self._is_hdr)
        return self._update(offset, colors, view.disparity, view.inpainted, is_final)

    def _without_flying_pixels(
        self, offset: ViewOffset, stored: StoredColors, disparity: FloatImage, inpainted: NDArray[np.bool_]
    ) -> StoredColors:
        return without_flying_pixels(self._rays, offset, stored, disparity, inpainted, 1)

    def _update(
        self,
        offset: ViewOffset,
        colors: StoredColors,
        disparity: FloatImage,
        inpainted: NDArray[np.bool_],
        is_final: bool,
    ) -> ViewUpdate:
        (v, u), (t, s) = self._grid.centre, offset
        return ViewUpdate(v + round(t), u + round(s), colors, disparity, inpainted, is_final)


def stored_colors(rays: RaySet, offset: ViewOffset, view: RenderedView, is_hdr: bool) -> StoredColors:
    """The colours (H, W, 3) of a view made of the rays of a photo, as they are stored, without flying pixels.

    Specks are told from what is stored: so a draft that was finished is what was made at once.
    """
    stored = encode_for_storage(view.colors, is_hdr, 1)
    return without_flying_pixels(rays, offset, stored, view.disparity, view.inpainted, 1)


def encode_for_storage(encoded: FloatImage, is_hdr: bool, threads: int | None = None) -> StoredColors:
    """`stored_from_encoded`, in bands."""
    stored = np.empty(encoded.shape, np.float16 if is_hdr else np.uint8)

    def band(first: int, last: int) -> None:
        stored[first:last] = stored_from_encoded(encoded[first:last], is_hdr)

    in_bands(band, image_size(encoded), threads)
    return stored
