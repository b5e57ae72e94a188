"""What a process takes in all, so that `--memory` is a bound: refused or made smaller before anything is allocated.

The whole is counted: the process before it does anything, which was measured, and the arrays that it holds at the
same time, each by its name and type. `python -m benchmarks.memory predicted` compares it with processes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iibr_core.generation.outer_views import outer_views_of_grid
from iibr_core.runtime.machine import (
    memory_bytes,
    usual_budget_bytes,
)
from iibr_core.runtime.tiling import MOST_BAND_PIXELS, THREADS
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset


def bytes_of(**arrays: str) -> int:
    """What one pixel takes in these arrays: each by its name, and of what type its values are there; "3f4" is three
    floats of four bytes.
    """
    return sum(np.dtype(each).itemsize for each in arrays.values())


MIB = 2**20
VIEWER_BYTES, WRITER_BYTES = 370 * MIB, 280 * MIB
"""Measured, of a process that does nothing yet: Python and compiled kernels; OpenGL, where views are shown."""
HEADROOM = 1.15
"""Times the arrays: small ones are not counted, and heaps are never full."""
READING_BYTES, DEPTH_MAP_BYTES, TILE_BYTES = 90, 26, 121
"""Measured, the most per pixel: of a photo while it is read and its depth looked for; of a map of depth while it
becomes disparity; of the tile of a photo at its own size that is being drawn, beside its rays.
"""
USUAL_HOLES, USUAL_AMBIGUOUS = 0.12, 0.2
"""Shares of a view, before anything is known of a scene but its size."""
PHOTO_BYTES = bytes_of(colors="3f4", found="f4", refined="f4", field="f4", stored="3u1", inpainted="?")
RAY_BYTES = bytes_of(colors="3f4", disparity="f4", coverage="f4", edge_level="u1")
"""Of one source image, see `RaySet`."""
DETAIL_BYTES = bytes_of(detail="f4", disparity="f4", connected="u1")
KEPT_BYTES = 15
"""Measured: what the allocator keeps of each view that is done."""
VIEW_BYTES = KEPT_BYTES + bytes_of(
    colors="3f4", disparity="f4", occluded="?", inpainted="?", uncovered="f4", hole="?", number="i4"
)
"""Of a view in the making."""
CANDIDATE_BYTES = bytes_of(coverage="5f4", disparity="5f4", source="5u1", weights="5f4", count="u1", shown="f4")
BAND_BYTES = CANDIDATE_BYTES + bytes_of(image="u1", colors="3f4")
"""Of the rows in the making."""
HOLE_BYTES = bytes_of(
    pixel="i8", around="16i4", reach="f4", changed="3f4", smooth="3f4", trust="f4", shown="4f4", patched="3f4"
)
"""Of one pixel of a hole while it is filled: what surrounds it in sixteen directions."""
DRAFT_BYTES = bytes_of(colors="3u1", with_flying_pixels="3u1", disparity="f4", inpainted="?")
MAP_BYTES = bytes_of(values="f4", is_known="?", is_finite="?")
STORED_BYTES, STORED_HDR_BYTES = (bytes_of(colors=each, disparity="f4") for each in ("3u1", "3f2"))
TARGET_BYTES = bytes_of(light="4f4", color="4f2")
MOST_TARGET_PIXELS = 8_000_000
"""What a picture is drawn into; larger ones are drawn in parts."""
PICTURE_BYTES = bytes_of(drawn="3u1", turned="3u1", encoded="3u1")
FLOAT_PICTURE_BYTES = bytes_of(drawn="4f4", turned="4f4", linear="4f4", encoded="4f4")
OWN_SIZE_BYTES = bytes_of(colors="3f4", light="3f4", disparity="f4")
"""Of a photo that is drawn at its own size."""
TILE_IMAGES = 7
"""Source images that a tile is drawn from: its own two, and what was inpainted on the side that is looked at from."""
MOST_COMPLETING = 10
"""Views that complete the rays of several photos: three rows of three at most, and the centre."""
USUAL_GRID = GridShape(5, 5)
"""A photo is made no smaller than that so many of its views fit; more are not worth its details."""
LEAST_PIXELS = 10_000


class Making(NamedTuple):
    """What views are made of: the photo's pixels, those of the photo continued beyond its frame (`canvas_pixels`), the
    source images of that size, the share of a view that is hole, and of its rays that are ambiguous.
    """

    pixels: float
    canvas_pixels: float
    images: int
    hole_share: float
    ambiguous_share: float

    @classmethod
    def usual(cls, pixels: float) -> Making:
        """What scenes take before anything is known of them but their size."""
        images = 2 + len(outer_views_of_grid(USUAL_GRID))
        return cls(pixels, pixels, images, USUAL_HOLES, USUAL_AMBIGUOUS)


def undecided_bytes() -> int:
    """Of a ray that the transformer is still to be asked for. Imported here: a plan loads kernels once it is made."""
    from iibr_core.rendering.ambiguous_rays import HYPOTHESES

    of_hypothesis = bytes_of(disparity="f4", source="u1", share="f4", nearest="f4")
    return bytes_of(pixel="i4", number="u1", uncovered="f4") + HYPOTHESES * of_hypothesis


def _ambiguous_bytes() -> int:
    """The same, of a ray that it is being asked for."""
    from iibr_core.rendering.ambiguous_rays import HYPOTHESES
    from iibr_core.rendering.hypotheses import FEATURES

    return undecided_bytes() + HYPOTHESES * bytes_of(mask="?", features=f"{FEATURES}f4")


def making_bytes(making: Making) -> int:
    """The most that is held while views are made, beside the photo and views that are done: the ray set; and then a
    view for each core, or the one whose holes are filled.
    """
    pixels = making.pixels
    band = min(pixels, MOST_BAND_PIXELS)
    in_flight = THREADS * (pixels * VIEW_BYTES + band * (BAND_BYTES + making.ambiguous_share * _ambiguous_bytes()))
    filling = pixels * (VIEW_BYTES + making.hole_share * HOLE_BYTES)
    rays = making.images * RAY_BYTES + DETAIL_BYTES
    return round(making.canvas_pixels * rays + max(in_flight, filling))


class Budget(NamedTuple):
    """What a process may take. said: where that comes from, for people."""

    bytes: int
    said: str

    def require(self, needed: float, what: str, advice: str) -> None:
        """Raise InputError where that is not enough. what: takes so much; advice: what to do, after a colon."""
        if needed > self.bytes:
            said = f"{what} takes {mebibytes(needed)}, {self.said} {mebibytes(self.bytes)}"
            raise InputError(f"{said}: {advice}")


def budget_of(wanted_bytes: int | None) -> Budget:
    """The user's, where it is no larger than the machine. Raises InputError for nonsense."""
    if wanted_bytes is not None and wanted_bytes <= 0:
        raise InputError(f"--memory {wanted_bytes}: give a positive number of bytes")
    machine = memory_bytes()
    if wanted_bytes is None:
        return Budget(usual_budget_bytes(), "the budget (--memory) is")
    return Budget(wanted_bytes, "--memory is") if wanted_bytes <= machine else Budget(machine, "this machine has")


def require_process(budget: Budget, keeps_views: bool) -> None:
    """Raise InputError where not even the smallest photo fits."""
    needed = process_bytes(keeps_views) + LEAST_PIXELS * READING_BYTES
    what = "showing the smallest photo" if keeps_views else "writing the views of the smallest photo"
    budget.require(needed, what, "raise --memory, or take a machine that has as much")


def process_bytes(keeps_views: bool) -> int:
    """Of a process that does nothing yet. keeps_views: it shows them, rather than write them one by one."""
    return VIEWER_BYTES if keeps_views else WRITER_BYTES


def view_bytes(pixels: int, is_hdr: bool) -> int:
    """Of one view of a light field."""
    return pixels * (STORED_HDR_BYTES if is_hdr else STORED_BYTES)


def whole_bytes(pixels: int, field_bytes: int, making_bytes: int, keeps_views: bool) -> int:
    """The most that a process takes from reading a photo of so many pixels to its last view.

    field_bytes: of all views, which count where they are kept. making_bytes: beside them while they are made.
    """
    making = pixels * PHOTO_BYTES + (field_bytes if keeps_views else 0) + making_bytes
    return process_bytes(keeps_views) + round(HEADROOM * max(pixels * READING_BYTES, making))


def pixels_within(budget: Budget, grid: GridShape | None, keeps_views: bool = True) -> int:
    """How large a photo may be before anything is known of it: so that a few views, or those asked for where they are
    fewer, fit.
    """
    views = min(math.prod(grid or USUAL_GRID), math.prod(USUAL_GRID))
    each = PHOTO_BYTES + (views * STORED_BYTES if keeps_views else 0)
    room = (budget.bytes - process_bytes(keeps_views)) / HEADROOM
    if views == 1:
        return max(int(room / max(each, READING_BYTES)), LEAST_PIXELS)
    # Of photos larger than a band, all but the bands' share grows with their pixels.
    least, more = (making_bytes(Making.usual(count * MOST_BAND_PIXELS)) for count in (1, 2))
    growing = (more - least) / MOST_BAND_PIXELS
    return max(int((room - (2 * least - more)) / (each + growing)), LEAST_PIXELS)


def largest_side(budget: Budget, needed_beside: int, each_view: int) -> int:
    """So many views a side of a square grid fit beside what else is needed; 0 where none does."""
    return math.isqrt(int(max(budget.bytes - needed_beside, 0) / (HEADROOM * max(each_view, 1))))


def require_reading(budget: Budget, size: ImageSize) -> None:
    """Raise InputError where a photo, made this (height, width) while it is read, cannot even be read."""
    needed = WRITER_BYTES + math.prod(size) * READING_BYTES
    fitting = pixels_within(budget, None, keeps_views=False)
    budget.require(needed, f"a photo of {size}", f"give --max-pixels {fitting}, or raise --memory")


def require_decoding(budget: Budget, name: str, decoding_bytes: int, keeps_views: bool) -> None:
    """Raise InputError where a photo's format makes decoders hold more at once than there is."""
    what = f"{name} cannot be decoded row by row: that"
    advice = "raise --memory, or save it as a PNG or a JPEG that is not progressive"
    budget.require(process_bytes(keeps_views) + decoding_bytes, what, advice)


def require_map(budget: Budget, name: str, size: ImageSize, bytes_beside: int, keeps_views: bool) -> None:
    """Raise InputError where a disparity map of this (height, width) is too large to be read.

    bytes_beside: what reading its format holds of each pixel. A name ending in `_depth` is one of depth.
    """
    each = MAP_BYTES + bytes_beside + (DEPTH_MAP_BYTES if name.rpartition(".")[0].endswith("_depth") else 0)
    needed = process_bytes(keeps_views) + math.prod(size) * each
    budget.require(needed, f"the map {name} ({size})", "raise --memory, or make the map smaller")


def require_views(budget: Budget, name: str, size: ImageSize, grid: GridShape) -> None:
    """Raise InputError where so many views of this (height, width) cannot be shown, before the first is made."""
    pixels, views = math.prod(size), math.prod(grid)
    beside, each = VIEWER_BYTES + pixels * PHOTO_BYTES, view_bytes(pixels, is_hdr=False)
    side = largest_side(budget, beside + making_bytes(Making.usual(pixels)), each)
    advice = f"at most --grid {side}, or " if side > 1 else ""
    what = f"{grid.columns} x {grid.rows} views of {name} ({size})"
    budget.require(beside + round(HEADROOM * views * each), what, f"{advice}raise --memory or lower --max-pixels")


def require_field(budget: Budget, name: str, size: ImageSize, grid: GridShape) -> None:
    """Raise InputError where a light field from disk, its views of this (height, width), cannot be shown."""
    needed = VIEWER_BYTES + view_bytes(math.prod(size) * math.prod(grid), is_hdr=False)
    budget.require(
        needed, f"{name}: {grid.columns} x {grid.rows} views of {size}", "raise --memory, or take fewer views"
    )


def require_dense_field(budget: Budget, name: str, size: ImageSize, sparse: GridShape) -> None:
    """Raise InputError where views cannot be made between those of a sparse grid, each of this (height, width)."""
    rays = 2 * RAY_BYTES * (math.prod(sparse) + MOST_COMPLETING)
    each = STORED_HDR_BYTES * math.prod(sparse) + rays + THREADS * (READING_BYTES + VIEW_BYTES)
    what = f"making views between {sparse.columns} x {sparse.rows} of {name} ({size})"
    budget.require(WRITER_BYTES + math.prod(size) * each, what, "raise --memory, or take fewer or smaller views")


def require_matching(
    budget: Budget, name: str, size: ImageSize, range_px: tuple[float, float], offsets: Sequence[ViewOffset]
) -> None:
    """Raise InputError where the disparity of the first of these views of this (height, width) cannot be found.

    range_px: least and greatest that it may have.
    """
    from iibr_core.depth.multi_view.estimate_disparity import sweep_bytes

    at = offsets[0]
    reach = max(max(abs(offset.t - at.t), abs(offset.s - at.s)) for offset in offsets)
    budget.require(sweep_bytes(size, range_px, reach), f"{name}: finding its disparity", "raise --memory")


def require_picture(budget: Budget, size: ImageSize, is_float: bool) -> None:
    """Raise InputError where a picture of this (height, width) cannot be drawn and written, whatever it shows."""
    pixels = math.prod(size)
    drawing = min(pixels, MOST_TARGET_PIXELS) * TARGET_BYTES
    needed = VIEWER_BYTES + drawing + pixels * (FLOAT_PICTURE_BYTES if is_float else PICTURE_BYTES)
    budget.require(needed, f"a picture of {size}", "give a smaller --size or raise --memory")


def require_own_size(
    budget: Budget, size: ImageSize, view: ImageSize, field_bytes: int, tile: ImageSize, shows_hidden: bool
) -> None:
    """Raise InputError where a picture at the photo's own (height, width) takes more than there is.

    view: the size of the light field's views; field_bytes: of those that stay there meanwhile. tile: the size of the
    largest tile, with what is read around it. shows_hidden: whether the picture shows what the photo hides.
    """
    needed = own_size_bytes(size, view, field_bytes, tile, shows_hidden)
    budget.require(needed, f"a picture at the photo's own size, {size},", "raise --memory, or save a smaller picture")


def own_size_bytes(size: ImageSize, view: ImageSize, field_bytes: int, tile: ImageSize, shows_hidden: bool) -> int:
    """What a process takes that draws such a picture; see `require_own_size`."""
    images = TILE_IMAGES if shows_hidden else 2
    drawing = math.prod(size) * OWN_SIZE_BYTES + math.prod(tile) * (images * RAY_BYTES + TILE_BYTES)
    photo = math.prod(view) * PHOTO_BYTES
    making = making_bytes(Making.usual(math.prod(view))) if shows_hidden else 0
    fills = math.prod(view) * Making.usual(0).images * RAY_BYTES if shows_hidden else 0
    return VIEWER_BYTES + round(HEADROOM * (photo + field_bytes + max(making, fills + drawing)))


def require_free_views(budget: Budget, canvas: ImageSize, largest: ImageSize) -> None:
    """Raise InputError where views of cameras cannot be made. canvas: (height, width) of the photo as far as they look
    beyond its frame; largest: of their pictures.
    """
    needed = WRITER_BYTES + math.prod(canvas) * PHOTO_BYTES + making_bytes(Making.usual(math.prod(canvas)))
    needed += math.prod(largest) * FLOAT_PICTURE_BYTES
    budget.require(needed, f"views of {largest} from a canvas of {canvas}", "raise --memory or lower --max-pixels")


def mebibytes(count: float) -> str:
    """For people."""
    return f"{math.ceil(count / MIB):,} MiB"
