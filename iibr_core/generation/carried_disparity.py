"""The disparity of one view of a light field, carried to all of them: one surface, seen from everywhere alike."""

from __future__ import annotations

from collections.abc import Iterator

from iibr_core.formats.images.photo import focal_px_from_fov
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.types import Disparity, FloatImage, GridShape, Photo, ViewUpdate


def carry_disparity(colors: FloatImage, disparity: FloatImage, grid: GridShape) -> Iterator[ViewUpdate]:
    """Every view of a grid with its disparity, the centre first, then those nearest to it; its colours are made.

    colors: (H, W, 3) of the centre view, encoded. disparity: (H, W) of the centre view, px per step of the grid. What
    the centre view does not see is continued from the background. Raises InputError
    where a value is not finite or memory does not suffice.
    """
    photo = Photo(colors, focal_px_from_fov(colors.shape[1]), "the centre view")
    given = Disparity(disparity, "the centre view")
    plan = plan_literal(photo, given, grid, quality="fast")
    return generate(photo, given, plan, quality="fast")
