"""The light field that is open on the graphics card, and the single view that may stand in for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import moderngl

from iibr_core.types import ColorSpace, GridShape, InputError, ViewUpdate
from viewer.gpu.gloss_textures import GlossTextures
from viewer.gpu.light_field_texture import LightFieldTexture

if TYPE_CHECKING:
    from iibr_core.rendering.gloss import GlossMaps


class OpenField:
    """field: of the views, None before the first. note: what had to be left out, a sentence for people."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self.field: LightFieldTexture | None = None
        self.note = ""
        self._stand_in: LightFieldTexture | None = None

    def open(
        self, grid: GridShape, width: int, height: int, hdr: bool, with_disparity: bool, color_space: ColorSpace
    ) -> None:
        """Start an empty one; see `Renderer.open_field`."""
        field, self.note = field_that_fits(self._ctx, grid, width, height, hdr, with_disparity)
        if self.field is not None:
            self.field.release()
        field.color_space = color_space
        self.field = field

    @property
    def loaded(self) -> LightFieldTexture:
        """The field of the views. Raises ValueError before the first."""
        if self.field is None:
            raise ValueError("no light field is open")
        return self.field

    @property
    def drawn(self) -> LightFieldTexture:
        """What is drawn: the view that stands in, else the field."""
        return self._stand_in or self.loaded

    def stand_in(self, view: ViewUpdate | None) -> None:
        """See `Renderer.stand_in`."""
        if self._stand_in is not None:
            self._stand_in.release()
            self._stand_in = None
        if view is not None:
            field = self.loaded
            size = field.grid, field.width, field.height
            self._stand_in = LightFieldTexture(self._ctx, *size, field.hdr, with_disparity=True, stride=max(field.grid))
            self._stand_in.upload(*field.grid.centre, view.colors, view.disparity)

    def set_gloss(self, maps: GlossMaps | None) -> None:
        """See `Renderer.set_gloss`."""
        field = self.loaded
        if field.gloss is not None:
            field.gloss.release()
        field.gloss = None if maps is None else GlossTextures(self._ctx, maps)

    def release(self) -> None:
        """Free the arrays."""
        for field in (self.field, self._stand_in):
            if field is not None:
                field.release()
        self.field = self._stand_in = None


def field_that_fits(
    ctx: moderngl.Context, grid: GridShape, width: int, height: int, hdr: bool, with_disparity: bool
) -> tuple[LightFieldTexture, str]:
    """Room for as many views as the driver can hold, and a sentence where that is not all.

    Raises InputError where it cannot hold a single one.
    """
    note = ""
    for stride in range(1, max(grid) + 1):
        try:
            return LightFieldTexture(ctx, grid, width, height, hdr, with_disparity, stride), note
        except InputError as error:
            if stride == max(grid):
                raise
            note = f"showing every {_ordinal(stride + 1)} view across and down: {error}"
    raise AssertionError("the last try returns or raises")


def _ordinal(number: int) -> str:
    return f"{number}{ {2: 'nd', 3: 'rd'}.get(number, 'th') }"
