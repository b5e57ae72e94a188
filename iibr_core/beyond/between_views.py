"""Views between a few given views of a light field: the paper's loop with rays of several photos.

Every given view has its own rays. A new view is the mean of the views that the given views around it make in closed
form, each of which resolves occlusion by its own disparity; it is weighted by nearness and by the share of a ray that
is covered. Pixels that none of them shows are inpainted once and join the rays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from math import hypot

import numpy as np

from iibr_core.color import encoded_from_stored
from iibr_core.depth.multi_view.all_views import estimate_all
from iibr_core.depth.multi_view.estimate import sweep_bytes
from iibr_core.depth.multi_view.settle import settle
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.order import grid_of
from iibr_core.formats.light_fields.views import read_views
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.registry import Inpainter
from iibr_core.method.light_field import encode_for_storage, nearest_first
from iibr_core.method.memory import require_memory
from iibr_core.method.rays import RaySet, rays_of_photo
from iibr_core.method.view import Renderer, View
from iibr_core.runtime.tiling import side_by_side
from iibr_core.runtime.work import Cancelled, raise_if_stopped, report_progress
from iibr_core.types import CENTRE, FloatImage, GridShape, InputError, StoredColors, ViewOffset, ViewUpdate, image_size

VIEW_BYTES = 60
"""Bytes of a pixel of each given view: its colours, its disparity, and two images of rays."""
MAX_COMPLETING = 10
"""Largest number of views that complete the rays: three rows of three, and the centre."""
FAR_WEIGHT = 0.02
"""Weight of a given view a whole step away, against 1 for one at the same place."""
COVERED_POWER = 2
"""Exponent of the covered share of a ray in the weight of a given view."""


def read_given_views(scene: MultiView) -> list[ViewUpdate]:
    """Return all views of a light field that fill a grid, with their disparity, estimated if the files have none.

    Raises InputError if a file cannot be read, no disparity can be found, or memory does not suffice.
    """
    grid, (size, views) = grid_of(scene), read_views(scene)
    if len(scene.views) < math.prod(grid):
        raise InputError(f"{scene.place}: only {len(scene.views)} of {math.prod(grid)} views are there; get the others")
    what = f"making views between {grid.columns}x{grid.rows} of {scene.name} ({size})"
    require_memory(math.prod(size) * math.prod(grid) * VIEW_BYTES, what)
    read: list[ViewUpdate] = []
    for view in views:
        raise_if_stopped()
        read.append(view)
        report_progress(len(read), math.prod(grid), "reading views")
    if any(view.disparity is None for view in read):
        settled = settle(replace(scene, numbers=()), read)
        range_px = settled.coarse.range_px
        require_memory(sweep_bytes(size, range_px, float(max(grid) - 1)), f"{scene.name}: finding its disparity")
        maps = estimate_all([view.colors for view in settled.views], settled.offsets, range_px)
        read = [replace(view, disparity=values) for view, values in zip(settled.views, maps)]
    return read


def require_steps(sparse: GridShape, dense: GridShape, name: str = "the light field") -> int:
    """Return the number of steps of the dense grid in one step of the sparse grid.

    Raises InputError, which names the light field, if its views have no places on the dense grid.
    """
    for steps in range(2, max(dense) + 1):
        if max(sparse) > 1 and dense == _denser(sparse, steps):
            return steps
    raise InputError(f"{name}: its {sparse.rows}x{sparse.columns} views {_advice(sparse, dense)}")


def _denser(sparse: GridShape, steps: int) -> GridShape:
    """Return the grid with `steps` steps between views of a sparse grid."""
    return GridShape(*(1 + (views - 1) * steps for views in sparse))


def _advice(sparse: GridShape, dense: GridShape) -> str:
    if max(sparse) == 1:
        return "have none beside them to go between: generate views of the picture itself"
    grids = ", ".join(f"{grid.rows}x{grid.columns}" for grid in (_denser(sparse, steps) for steps in (2, 3, 4)))
    return f"have no places on a grid of {dense.rows}x{dense.columns} (rows x columns): give {grids} and so on"


def densify(
    given: Sequence[ViewUpdate],
    sparse: GridShape,
    dense: GridShape,
    inpainter: Inpainter = fill_background,
    nearest_to: Callable[[], ViewOffset] = lambda: CENTRE,
    row_step: float = 1.0,
) -> Generator[ViewUpdate]:
    """Yield every view of the dense grid once: the centre, the given ones unchanged, then those nearest to
    `nearest_to()`.

    given: all views of the sparse grid, of equal size, with disparity in px per step of it; that of the dense grid is
    per column of it. row_step: distance between rows, in distances between columns. Raises InputError as
    `require_steps` does.
    """
    steps, is_hdr = require_steps(sparse, dense), given[0].colors.dtype != np.uint8
    own = {
        dense.offset(view.row * steps, view.column * steps): (view.colors, view.disparity / np.float32(steps))
        for view in given
        if view.disparity is not None
    }
    completing = [offset for offset in _completing_views(sparse, dense, steps) if offset not in own]
    every = [dense.offset(*at) for at in np.ndindex(*dense)]
    remaining = [offset for offset in every if offset not in own and offset not in completing]
    # The centre comes first, given or not.
    early = 0 if CENTRE in own else 1

    def stored(offset: ViewOffset, view: View) -> ViewUpdate:
        colors = encode_for_storage(view.colors, is_hdr, 1)
        return ViewUpdate(*dense.index_of(offset), colors, view.disparity, view.inpainted)

    with suppress(Cancelled):
        views = _ViewsBetween(own, steps, max(dense), inpainter, row_step)
        for offset in completing[:early]:
            yield stored(offset, views.complete(offset))
        for offset, (colors, disparity) in sorted(own.items(), key=lambda item: hypot(*item[0])):
            yield ViewUpdate(*dense.index_of(offset), colors, disparity, np.zeros(disparity.shape, np.bool_))
        for offset in completing[early:]:
            yield stored(offset, views.complete(offset))
        yield from side_by_side(lambda offset: stored(offset, views.make(offset)), nearest_first(remaining, nearest_to))


class _ViewsBetween:
    """Makes views between given ones, in several threads once the rays are complete."""

    def __init__(
        self,
        given: Mapping[ViewOffset, tuple[StoredColors, FloatImage]],
        steps: int,
        longer_side: int,
        inpainter: Inpainter,
        row_step: float,
    ) -> None:
        self._renderer, self._steps, self._inpainter, self._row_step = Renderer(), steps, inpainter, row_step
        farthest = max(row_step, 1.0)
        self._sources = {
            offset: rays_of_photo(encoded_from_stored(colors), disparity, steps * farthest, 0)
            for offset, (colors, disparity) in given.items()
        }
        self._farthest = longer_side * farthest
        self._inpainted: tuple[ViewOffset, RaySet] | None = None

    def complete(self, offset: ViewOffset) -> View:
        """Return the view at an offset after its inpainted pixels have joined the rays."""
        view = self.make(offset)
        if view.occluded.any():
            if self._inpainted is None:
                self._inpainted = offset, RaySet(MAX_COMPLETING, image_size(view.disparity), self._farthest)
            origin, rays = self._inpainted
            disparity = np.where(view.occluded, view.disparity, np.float32(np.nan))
            rays.add(self._moved(origin, offset), view.colors, disparity, view.occluded)
        return view

    def make(self, offset: ViewOffset) -> View:
        """Return the view at an offset."""
        view = self._merge(offset)
        colors, disparity, hole = view.colors, view.disparity, view.occluded
        if hole.any() and self._inpainted is not None:
            origin, rays = self._inpainted
            filled, _ = self._renderer.visible(rays, self._moved(origin, offset))
            is_filled = hole & ~filled.occluded
            colors[is_filled], disparity[is_filled] = filled.colors[is_filled], filled.disparity[is_filled]
            hole &= filled.occluded
        if hole.any():
            at, nearest = min(self._sources.items(), key=lambda source: hypot(*self._moved(source[0], offset)))
            self._inpainter(colors, disparity, hole, nearest.photo_disparity, self._moved(at, offset), 1)
        return view

    def _merge(self, offset: ViewOffset) -> View:
        """Return the mean of the given views around, seen from an offset, with holes."""
        size = next(iter(self._sources.values())).view_size
        colors, disparity = np.zeros((*size, 3), np.float32), np.zeros(size, np.float32)
        total, heaviest = np.zeros(size, np.float32), np.zeros(size, np.float32)
        for at, rays in self._sources.items():
            away = ViewOffset(offset.t - at.t, offset.s - at.s)
            if max(map(abs, away)) > self._steps:
                continue
            view, covered = self._renderer.visible(rays, self._moved(at, offset))
            near = (1 - abs(away.t) / self._steps) * (1 - abs(away.s) / self._steps) + FAR_WEIGHT
            weight = np.where(view.occluded, np.float32(0), np.float32(near) * covered**COVERED_POWER)
            # Encoded, as colours of one surface are interpolated: all views show the same light.
            colors += weight[..., None] * np.where(weight[..., None] > 0, view.colors, 0)
            np.copyto(disparity, view.disparity, where=weight > heaviest)
            np.maximum(heaviest, weight, out=heaviest)
            total += weight
        hole = ~(total > 0)
        colors /= np.where(hole, np.float32(1), total)[..., None]
        return View(colors, disparity, hole, hole.copy())

    def _moved(self, origin: ViewOffset, offset: ViewOffset) -> ViewOffset:
        """Return the offset from one viewpoint to another, in distances between columns."""
        return ViewOffset(self._row_step * (offset.t - origin.t), offset.s - origin.s)


def _completing_views(sparse: GridShape, dense: GridShape, steps: int) -> list[ViewOffset]:
    """Return views half-way between given ones, at the corners and in the middle of the grid, the centre first.

    Together they see nearly everything that no given view sees.
    """
    rows, columns = (
        {first * steps + ((steps + 1) // 2 if views > 1 else 0) for first in (0, (views - 1) // 2, max(views - 2, 0))}
        for views in sparse
    )
    places = sorted({*product(rows, columns), dense.centre})
    return sorted((dense.offset(*at) for at in places), key=lambda offset: hypot(*offset))
