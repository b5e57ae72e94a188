"""Light fields to measure with: views from a folder, disparity of every view made from the centre view's."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.refocus import read_views
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.types import Disparity, GridShape, Photo
from viewer.gpu.refocus.renderer import Renderer


@dataclass(frozen=True)
class StoredField:
    """views: (V, U, H, W, 3) uint8. disparities: (V, U, H, W), px per view step."""

    name: str
    views: NDArray[np.uint8]
    disparities: NDArray[np.float32]

    @property
    def grid(self) -> GridShape:
        """Rows and columns of views."""
        return GridShape(*self.views.shape[:2])

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height)"""
        return self.views.shape[3], self.views.shape[2]

    def upload(self, renderer: Renderer, chosen: Iterable[tuple[int, int]], hdr: bool = False) -> None:
        """Open the field in a renderer and upload these views."""
        renderer.open_field(self.grid, *self.size_px, hdr=hdr, with_disparity=True)
        for at in chosen:
            colors = (self.views[at] / np.float16(255)).astype(np.float16) if hdr else self.views[at]
            renderer.upload_view(*at, colors, self.disparities[at])

    @property
    def every(self) -> list[tuple[int, int]]:
        """Indices of all views."""
        return list(np.ndindex(*self.grid))


def read_field(folder: Path) -> StoredField:
    """Views of a folder and the centre's disparity from folder/*.npy; what others hide is filled from behind."""
    grid, flat = read_views(folder)
    height, width = flat.shape[1:3]
    views = flat.reshape(*grid, height, width, 3)
    centre = np.nan_to_num(np.load(next(iter(sorted(folder.glob("*disp*.npy")))))).astype(np.float32)
    photo = Photo(views[grid.centre].astype(np.float32) / 255, float(width), folder.name)
    disparity = Disparity(centre, "file")
    plan = plan_literal(photo, disparity, grid)
    disparities = np.empty((*grid, height, width), np.float32)
    for update in generate(photo, disparity, plan):
        assert update.disparity is not None
        disparities[update.row, update.column] = update.disparity
    disparities[grid.centre] = centre
    return StoredField(folder.name, views, disparities)
