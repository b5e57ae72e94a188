"""The ray set. Every pixel of a source image is a ray with a colour and a disparity; the set is a stack of such images.

The photo comes first; the fringe (what mixed pixels hold of the surface in front) and inpainted views join it.
"""

from __future__ import annotations

import numpy as np

from iibr_core.kernels import kernel
from iibr_core.surroundings import Surroundings, surroundings_of
from iibr_core.types import FloatImage, ViewOffset


class RaySet:
    """Source images of one size (height, width), at most `capacity` of them.

    All arrays are (S, ...) for the S images added so far. offsets (S, 2): the view (t, s) each is seen from. colors
    (S, H, W, 3): sRGB-encoded. disparity (S, H, W): NaN where there is no surface. coverage (S, H, W): how much of
    its pixel a ray fills, 0 = no ray. near_edge (S, H, W) bool: True where a 4x4 look-up may meet another surface.
    row_disparity (S, H, 2): least and greatest of each row's rays. row_columns (S, H, 2): first and behind-last
    column of each row's rays.
    """

    def __init__(self, capacity: int, size: tuple[int, int], surface_step: float, farthest_views: float = 1.0) -> None:
        """surface_step: disparities closer than this are one surface for look-ups.

        farthest_views: the largest view offset that will be rendered.
        """
        self._count = 0
        self._surface_step = surface_step
        self._farthest_views = farthest_views
        self._surroundings: Surroundings | None = None
        self._offsets = np.empty((capacity, 2))
        self._colors = np.empty((capacity, *size, 3), np.float32)
        self._disparity = np.empty((capacity, *size), np.float32)
        self._coverage = np.empty((capacity, *size), np.float32)
        self._near_edge = np.empty((capacity, *size), np.bool_)
        self._row_disparity = np.empty((capacity, size[0], 2))
        self._row_columns = np.empty((capacity, size[0], 2), np.int64)

    def add(self, offset: ViewOffset, colors: FloatImage, disparity: FloatImage, coverage: FloatImage) -> None:
        """Add the rays of one image (H, W)."""
        k = self._count
        self._offsets[k] = offset
        self._colors[k], self._disparity[k], self._coverage[k] = colors, disparity, coverage
        _near_edge(disparity, self._surface_step, self._near_edge[k])
        _row_extents(disparity, coverage, self._row_disparity[k], self._row_columns[k])
        self._count += 1
        self._surroundings = None

    def __len__(self) -> int:
        return self._count

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of every image."""
        return self._disparity.shape[1], self._disparity.shape[2]

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """(offsets, colors, disparity, coverage, near_edge, row_disparity, row_columns) of the images added so far."""
        everything = (
            self._offsets, self._colors, self._disparity, self._coverage,
            self._near_edge, self._row_disparity, self._row_columns,
        )  # fmt: skip
        return tuple(array[: self._count] for array in everything)

    @property
    def surroundings(self) -> Surroundings:
        """What lies around the rays added so far; made when first asked for after the last was added."""
        if self._surroundings is None:
            self._surroundings = surroundings_of(self._disparity[: self._count], self._farthest_views)
        return self._surroundings

    @property
    def photo_images(self) -> int:
        """How many images, from the first on, hold what the photo shows; the others are inpainted."""
        return int((self._offsets[: self._count] == 0).all(axis=1).sum())

    @property
    def photo_disparity(self) -> FloatImage:
        """(H, W) disparity of the first image."""
        return self._disparity[0]


@kernel
def _row_extents(disparity, coverage, row_disparity, row_columns):  # type: ignore[no-untyped-def]
    """A row without rays has an empty range of disparities and of columns."""
    height, width = disparity.shape
    for y in range(height):
        low, high, first, last = np.inf, -np.inf, width, 0
        for x in range(width):
            if coverage[y, x] > 0:
                low, high = min(low, disparity[y, x]), max(high, disparity[y, x])
                first, last = min(first, x), x + 1
        row_disparity[y, 0], row_disparity[y, 1] = low, high
        row_columns[y, 0], row_columns[y, 1] = first, last


@kernel
def _near_edge(disparity, surface_step, near_edge):  # type: ignore[no-untyped-def]
    """True where the 4x4 pixels from (x - 1, y - 1) to (x + 2, y + 2) hold a larger step, or no surface."""
    height, width = disparity.shape
    near_edge[:] = False
    for y in range(height):
        for x in range(width):
            here = disparity[y, x]
            right = disparity[y, min(x + 1, width - 1)]
            below = disparity[min(y + 1, height - 1), x]
            if not (abs(right - here) <= surface_step and abs(below - here) <= surface_step):
                near_edge[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3] = True
