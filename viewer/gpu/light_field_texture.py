"""The views of a light field on the graphics card, an array layer each, filled as they arrive.

Colours are stored as the square root of linear light: summing light then costs one multiplication a fetch, not a power.
"""

from __future__ import annotations

import math
from copy import copy
from functools import cache
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored, linear_from_srgb
from iibr_core.remedies import FixableError, Remedy
from iibr_core.types import SRGB, FloatImage, GridShape, InputError, StoredColors
from viewer.gpu.gloss_texture import GlossTexture, Shared
from viewer.gpu.hidden_texture import HiddenTexture

if TYPE_CHECKING:
    from iibr_core.beyond.hidden_surfaces import HiddenSurface
    from iibr_core.gloss.shading import GlossMaps

_ROOT_FROM_SRGB = np.round(np.sqrt(linear_from_srgb(np.arange(256) / 255)) * 255).astype(np.uint8)

HALF_MAX = float(np.finfo(np.float16).max)

Box = tuple[slice, slice]
"""Rows and columns of pixels."""

SAMPLE_SIZE = 8192
"""About the number of disparities by which the slices of a picture through a lens are chosen."""
RANGE_MARGIN = 0.05
"""Margin around the disparity range of the first view, as a share of it: later views may exceed the range a little."""


class LightFieldTexture:
    """Texture arrays of the views.

    colors: RGBA8, or RGBA16F for HDR; alpha is the disparity scaled to 0..1 over `range_px`. disparities: R16F, px per
    view step. layers: (V, U), layer of each view. present, has_disparity: (V, U) bool. uploads: (V, U), number of times
    that a view was stored. color_space: of the light. row_step: distance between rows, in distances between
    columns. gloss: maps of a glossy surface, None without. hidden: the surface behind the centre view's, None until it
    is known. range_px: (farthest, nearest) disparity, disparity_sample: some disparities; both from the first view that
    has any. is_single: there is room for one of several views.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        grid: GridShape,
        width: int,
        height: int,
        hdr: bool,
        with_disparity: bool,
        is_single: bool = False,
    ) -> None:
        """Allocate the arrays. is_single: there is room for one view only, at any place of the grid.

        Raises InputError if this graphics driver cannot hold them, with what to do.
        """
        count = 1 if is_single else math.prod(grid)
        check_fits(ctx, GridShape(1, 1) if is_single else grid, width, height)
        self._ctx = ctx
        self.grid, self.width, self.height, self.hdr, self.color_space = grid, width, height, hdr, SRGB
        self.row_step, self.is_single = 1.0, is_single and math.prod(grid) > 1
        self.layers = np.arange(math.prod(grid)).reshape(grid) * (not is_single)
        self.present, self.has_disparity, self.uploads = np.zeros(grid, bool), np.zeros(grid, bool), np.zeros(grid, int)
        self.range_px = (0.0, 0.0)
        self.gloss: GlossTexture | None = None
        self.hidden: HiddenTexture | None = None
        self.disparity_sample: FloatImage = np.zeros(1, np.float32)
        self.colors = _allocate(ctx, (width, height, count), 4, "f2" if hdr else "f1")
        self.colors.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.disparities = _allocate(ctx, (width, height, count) if with_disparity else (1, 1, 1), 1, "f2")
        self.disparities.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._texels = np.zeros((height, width, 4), np.float16 if hdr else np.uint8)
        self._arrays = Shared(self.colors, self.disparities)

    def upload(self, row: int, column: int, colors: StoredColors, disparity: FloatImage | None) -> None:
        """Store the view at index (row, column).

        colors: (H, W, 3), see StoredColors. disparity: (H, W) px per view step; ignored in a field opened without.
        """
        keeps_disparity = disparity is not None and self.disparities.size == self.colors.size
        if disparity is not None and keeps_disparity:
            if not self.has_disparity.any():
                self._measure(_finite_half(disparity))
            self._store_disparity(row, column, disparity, np.s_[0 : self.height, 0 : self.width])
        else:
            self._texels[..., 3] = 0
        np.copyto(self._texels[..., :3], _root_of_linear(colors, self.hdr), casting="same_kind")
        self.colors.write(self._texels, (0, 0, int(self.layers[row, column]), self.width, self.height, 1))
        self.present[row, column], self.has_disparity[row, column] = True, keeps_disparity
        self.uploads[row, column] += 1

    def change_disparity(self, row: int, column: int, disparity: FloatImage, box: Box) -> None:
        """Store another disparity (H, W) of the view uploaded last, whose colours stay; only `box` has changed."""
        self._store_disparity(row, column, disparity, box)
        self.colors.write(np.ascontiguousarray(self._texels[box]), self._viewport(row, column, box))
        self.uploads[row, column] += 1

    def _store_disparity(self, row: int, column: int, disparity: FloatImage, box: Box) -> None:
        """Store the disparity within a box; the texels' alpha is set but not written."""
        values = _finite_half(disparity[box])
        self.disparities.write(values.astype(np.float16), self._viewport(row, column, box))
        far, near = self.range_px
        top_value = 1.0 if self.hdr else 255.0
        depth = np.clip((values - far) * (top_value / (near - far)), 0, top_value)
        np.copyto(self._texels[(*box, 3)], depth if self.hdr else np.rint(depth), casting="unsafe")

    def _measure(self, disparity: FloatImage) -> None:
        """Take range and sample from a disparity (H, W)."""
        self.range_px = _range_of(disparity)
        ends = disparity.min(), disparity.max()
        self.disparity_sample = np.append(disparity.ravel()[:: max(disparity.size // SAMPLE_SIZE, 1)], ends)

    def set_hidden(self, surface: HiddenSurface | None) -> None:
        """Show this surface behind the centre view's through an open lens; None: no surface."""
        if self.hidden is not None:
            self.hidden.release()
        self.hidden = None if surface is None else HiddenTexture(self._ctx, surface)

    def set_gloss(self, maps: GlossMaps | None) -> None:
        """Use these maps for optics with gloss; None if there are none."""
        if self.gloss is not None:
            self.gloss.release()
        self.gloss = None if maps is None else GlossTexture(self._ctx, maps)

    def share(self) -> LightFieldTexture:
        """Return the same arrays with the present views and gloss; views that come later are not present in it.

        Both are to be released. Until then no present view should be stored again.
        """
        shared = copy(self)
        shared.present, shared.has_disparity = self.present.copy(), self.has_disparity.copy()
        for each in (self.gloss, self.hidden, self._arrays):
            if each is not None:
                each.hold()
        return shared

    @property
    def is_shared(self) -> bool:
        """Whether the arrays have other holders."""
        return self._arrays.is_shared

    def release(self) -> None:
        """Free the arrays, unless another holder needs them."""
        for each in (self.gloss, self.hidden, self._arrays):
            if each is not None:
                each.release()

    def _viewport(self, row: int, column: int, box: Box) -> tuple[int, int, int, int, int, int]:
        rows, columns = box
        size = columns.stop - columns.start, rows.stop - rows.start
        return columns.start, rows.start, int(self.layers[row, column]), *size, 1


def check_fits(ctx: moderngl.Context, grid: GridShape, width: int, height: int) -> None:
    """Raise InputError if the driver's limits do not allow such arrays: GL itself fails silently."""
    max_layers, max_size = ctx.info["GL_MAX_ARRAY_TEXTURE_LAYERS"], ctx.info["GL_MAX_TEXTURE_SIZE"]
    layers = math.prod(grid)
    if layers > max_layers:
        side = math.isqrt(max_layers)
        raise InputError(
            f"a grid of {grid.rows}x{grid.columns} needs {layers} texture layers, this graphics driver has "
            f"{max_layers}: use at most {side}x{side} views"
        )
    if max(width, height) > max_size:
        largest = width * height * max_size**2 // max(width, height) ** 2
        raise FixableError(
            f"views of {width}x{height} px exceed this graphics driver's limit of {max_size} px; the largest photo has"
            f" {largest} pixels",
            Remedy.SMALLER,
        )


def _allocate(ctx: moderngl.Context, size: tuple[int, int, int], components: int, dtype: str) -> moderngl.TextureArray:
    ctx.error  # noqa: B018  (reading it clears errors of earlier calls)
    texture = None
    try:
        texture = ctx.texture_array(size, components, dtype=dtype)
        problem = ctx.error
    except moderngl.Error as error:
        problem = str(error)
    if texture is None or problem != "GL_NO_ERROR":
        if texture is not None:
            texture.release()
        width, height, layers = size
        mebibytes = width * height * layers * components * (2 if dtype == "f2" else 1) // 2**20
        message = f"no room for {layers} views of {width}x{height} ({mebibytes} MiB, {problem})"
        raise FixableError(message, Remedy.SMALLER)
    texture.repeat_x = texture.repeat_y = False
    return texture


def _root_of_linear(colors: StoredColors, hdr: bool) -> StoredColors:
    if hdr:
        halves = colors if colors.dtype == np.float16 else encoded_from_stored(colors).astype(np.float16)
        return _root_from_half()[halves.view(np.uint16)]
    if colors.dtype != np.uint8:
        raise ValueError("float colours in a field opened without hdr")
    return _ROOT_FROM_SRGB[colors.view(np.uint8)]


@cache
def _root_from_half() -> NDArray[np.float16]:
    """Return the root of linear light for each encoded half float, by its bits."""
    every = np.arange(2**16, dtype=np.uint16).view(np.float16)
    with np.errstate(invalid="ignore", over="ignore"):
        root = np.sqrt(linear_from_srgb(encoded_from_stored(np.nan_to_num(every))))
    return np.minimum(root, HALF_MAX).astype(np.float16)


def _finite_half(disparity: FloatImage) -> FloatImage:
    """Return the disparity within the range of half floats; differences of the largest floats are infinite."""
    return np.clip(disparity, -HALF_MAX, HALF_MAX)


def _range_of(disparity: FloatImage) -> tuple[float, float]:
    """Return (farthest, nearest) with a margin; a few stray pixels (under 1 in 5000) do not stretch it."""
    far, near = np.quantile(disparity, [0.0002, 0.9998])
    margin = RANGE_MARGIN * (near - far) + 1e-3
    return float(far - margin), float(near + margin)


def box_around(marks: NDArray[np.bool_]) -> Box:
    """Return the smallest box around all marks; there must be some."""
    rows, columns = (np.flatnonzero(marks.any(axis)) for axis in (1, 0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)
