"""A few views of a light field -> the views between them: the paper's loop with a ray set that begins with several
photos.

Every given view brings its own rays. What a new view shows is what the given views around it show there, each in its
own closed form, so occlusion is resolved where it is known best; they are averaged by how near they stand and by how
much of a ray theirs cover. What none of them shows is inpainted once, and joins the rays.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from math import hypot

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored
from iibr_core.generation.field_work import OUTER_WORK
from iibr_core.generation.light_field import nearest_first
from iibr_core.generation.stored_views import encode_for_storage
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.inpainter import Inpainter
from iibr_core.rendering.photo_rays import rays_of_photo
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.renderer import Renderer, open_renderer
from iibr_core.runtime.work import Cancelled
from iibr_core.surfaces import SAME_SURFACE_PX, step_of
from iibr_core.types import (
    FloatImage,
    GridShape,
    InputError,
    StoredColors,
    ViewOffset,
    ViewUpdate,
    image_size,
)

MOST_COMPLETING = 10
"""Views that complete the rays of several photos: three rows of three at most, and the centre."""
BESIDE_WEIGHT = 0.02
"""Of a given view a whole step away, against 1 for one in the very place: it counts where nearer ones see nothing."""
COVERED_POWER = 2
"""How a view's weight goes with how much of the ray its own rays cover."""


@dataclass(frozen=True, eq=False)
class GivenView:
    """A view of a sparse grid. row, column: its place there. colors: (H, W, 3), see StoredColors. disparity: (H, W)
    float32, px per step of the sparse grid.

    Raises InputError for disparities that are not finite.
    """

    row: int
    column: int
    colors: StoredColors
    disparity: FloatImage

    def __post_init__(self) -> None:
        if not np.isfinite(self.disparity).all():
            raise InputError(f"the view in row {self.row}, column {self.column}: its disparity is not finite; fill it")


def require_steps(sparse: GridShape, dense: GridShape, name: str = "the light field") -> int:
    """How many steps of the dense grid one of the sparse grid is.

    Raises InputError, which names the light field, where its views find no places.
    """
    steps = {
        (new - 1) // (old - 1) if new > old and (new - 1) % (old - 1) == 0 else 0
        for new, old in zip(dense, sparse)
        if old > 1
    }
    fits = len(steps) == 1 and 0 not in steps and all(new == 1 for new, old in zip(dense, sparse) if old == 1)
    if not fits:
        raise InputError(f"{name}: its {sparse.rows}x{sparse.columns} views {_advice(sparse, dense)}")
    return steps.pop()


def _advice(sparse: GridShape, dense: GridShape) -> str:
    if max(sparse) == 1:
        return "have none beside them to go between: give the picture itself to `iibr generate`"
    wider = [GridShape(*(1 + (old - 1) * steps for old in sparse)) for steps in (2, 3, 4)]
    fitting = ", ".join(f"{grid.rows}x{grid.columns}" for grid in wider)
    return f"have no places on a grid of {dense.rows}x{dense.columns} (rows x columns): give {fitting} and so on"


def densify(
    given: Sequence[GivenView],
    sparse: GridShape,
    dense: GridShape,
    inpainter: Inpainter = fill_background,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
) -> Generator[ViewUpdate, None, None]:
    """Every view of the dense grid once: the centre, those given as they are, then those between them, the nearest to
    `nearest_to()` first.

    given: all views of the sparse grid, of equal size. Disparity is per step of the dense grid. Raises InputError as
    `require_steps` does, ValueError where views differ in size or are missing.
    """
    steps = require_steps(sparse, dense)
    places = {(view.row, view.column) for view in given}
    if places != set(np.ndindex(*sparse)) or len({view.disparity.shape for view in given}) != 1:
        raise ValueError(f"{len(given)} views do not fill a grid of {sparse} or differ in size")
    with suppress(Cancelled):
        yield from _generate_views(given, steps, sparse, dense, inpainter, nearest_to)


def _generate_views(
    given: Sequence[GivenView],
    steps: int,
    sparse: GridShape,
    dense: GridShape,
    inpainter: Inpainter,
    nearest_to: Callable[[], ViewOffset],
) -> Iterator[ViewUpdate]:
    is_hdr = given[0].colors.dtype != np.uint8
    places = {(view.row * steps, view.column * steps): view for view in given}
    remaining = [dense.offset(*at) for at in np.ndindex(*dense) if at not in places]
    completing = [offset for offset in _completing_views(sparse, dense, steps) if offset in remaining]
    with open_renderer() as renderer:
        views = _ViewsBetween(renderer, given, steps, dense, inpainter)

        def update(offset: ViewOffset, view: _Merged) -> ViewUpdate:
            (v, u), colors = dense.centre, encode_for_storage(view.colors, is_hdr, 1)
            return ViewUpdate(v + round(offset.t), u + round(offset.s), colors, view.disparity, view.inpainted)

        done, total = 0.0, len(completing) * OUTER_WORK + len(remaining) - len(completing)
        if dense.centre not in places:
            done += OUTER_WORK / total
            yield replace(update(completing[0], views.complete(completing[0])), share=done)
        for (row, column), view in sorted(places.items(), key=lambda item: hypot(*dense.offset(*item[0]))):
            shown = np.zeros(view.disparity.shape, np.bool_)
            yield ViewUpdate(row, column, view.colors, view.disparity / np.float32(steps), shown, share=done)
        for offset in completing[dense.centre not in places :]:
            done += OUTER_WORK / total
            yield replace(update(offset, views.complete(offset)), share=done)
        remaining = [offset for offset in remaining if offset not in completing]
        for made in renderer.side_by_side(
            lambda offset: update(offset, views.make(offset)), nearest_first(remaining, nearest_to)
        ):
            done += 1 / total
            yield replace(made, share=done)


@dataclass(frozen=True, eq=False)
class _Merged:
    """A view that several given ones show. colors: (H, W, 3) sRGB-encoded. disparity: (H, W). hole: (H, W), True where
    none of all rays showed anything. inpainted: (H, W), True where no given view did.
    """

    colors: FloatImage
    disparity: FloatImage
    hole: NDArray[np.bool_]
    inpainted: NDArray[np.bool_]


class _ViewsBetween:
    """Makes views between given ones. Threads may make several at once when all that complete the rays are there."""

    def __init__(
        self,
        renderer: Renderer,
        given: Sequence[GivenView],
        steps: int,
        dense: GridShape,
        inpainter: Inpainter,
    ) -> None:
        self._renderer, self._steps, self._inpainter = renderer, steps, inpainter
        self._sources: list[tuple[ViewOffset, RaySet]] = [
            (
                dense.offset(view.row * steps, view.column * steps),
                rays_of_photo(encoded_from_stored(view.colors), view.disparity / np.float32(steps), steps, 0),
            )
            for view in given
        ]
        self._farthest = float(max(dense))
        self._inpainted: tuple[ViewOffset, RaySet] | None = None

    def complete(self, offset: ViewOffset) -> _Merged:
        """The view at an offset; what had to be inpainted there joins the rays."""
        view = self.make(offset)
        if view.hole.any():
            if self._inpainted is None:
                size = image_size(view.disparity)
                rays = RaySet(MOST_COMPLETING, size, step_of(SAME_SURFACE_PX, self._farthest), self._farthest)
                self._inpainted = offset, rays
            origin, rays = self._inpainted
            disparity = np.where(view.hole, view.disparity, np.float32(np.nan))
            rays.add(_between(origin, offset), view.colors, disparity, view.hole)
        return view

    def make(self, offset: ViewOffset) -> _Merged:
        """The view at an offset, without holes."""
        colors, disparity, hole = self._merge(offset)
        inpainted = hole.copy()
        if hole.any() and self._inpainted is not None:
            origin, rays = self._inpainted
            filled, _ = self._renderer.seen(rays, _between(origin, offset))
            np.copyto(colors, filled.colors, where=(hole & ~filled.occluded)[..., None])
            np.copyto(disparity, filled.disparity, where=hole & ~filled.occluded)
            hole &= filled.occluded
        if hole.any():
            at, nearest = min(self._sources, key=lambda source: np.hypot(*_between(source[0], offset)))
            photo_disparity = nearest.photo_disparity
            self._inpainter(colors, disparity, hole, photo_disparity, _between(at, offset))
        return _Merged(colors, disparity, hole, inpainted)

    def _merge(self, offset: ViewOffset) -> tuple[FloatImage, FloatImage, NDArray[np.bool_]]:
        """Colours (H, W, 3) and disparity (H, W) that the given views around show, and where they show nothing."""
        size = self._sources[0][1].view_size
        colors, disparity = np.zeros((*size, 3), np.float32), np.zeros(size, np.float32)
        total, heaviest = np.zeros(size, np.float32), np.zeros(size, np.float32)
        for at, rays in self._sources:
            away = _between(at, offset)
            if max(map(abs, away)) > self._steps:
                continue
            view, covered = self._renderer.seen(rays, away)
            near = (1 - abs(away.t) / self._steps) * (1 - abs(away.s) / self._steps) + BESIDE_WEIGHT
            weight = np.where(view.occluded, np.float32(0), np.float32(near) * covered**COVERED_POWER)
            # Encoded, as one surface's colours are interpolated: these are several looks at the same light.
            colors += weight[..., None] * np.where(weight[..., None] > 0, view.colors, 0)
            np.copyto(disparity, view.disparity, where=weight > heaviest)
            np.maximum(heaviest, weight, out=heaviest)
            total += weight
        hole = ~(total > 0)
        colors /= np.where(hole, np.float32(1), total)[..., None]
        return colors, disparity, hole


def _completing_views(sparse: GridShape, dense: GridShape, steps: int) -> list[ViewOffset]:
    """In the midst of given views, so as far from them as a view can be: those of the corners of the grid and of its
    middle. Together they see nearly all that none of the given views does. The centre comes first, given or not.
    """
    rows, columns = (
        {first * steps + ((steps + 1) // 2 if views > 1 else 0) for first in (0, (views - 1) // 2, max(views - 2, 0))}
        for views in sparse
    )
    places = sorted({*product(rows, columns), dense.centre})
    return sorted((dense.offset(*at) for at in places), key=lambda offset: hypot(*offset))


def _between(origin: ViewOffset, offset: ViewOffset) -> ViewOffset:
    """From one viewpoint to another."""
    return ViewOffset(offset.t - origin.t, offset.s - origin.s)
