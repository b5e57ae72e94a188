"""Light fields whose every view is known exactly: a textured background and a disc before it, each at one disparity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.refocus.picture_renderer import Renderer


@dataclass(frozen=True)
class TwoPlanes:
    """background, foreground: disparities of wall and disc, px per view step. Colours are smooth, the edge is hard."""

    width: int = 96
    height: int = 72
    background: float = -1.0
    foreground: float = 2.0
    radius_px: float = 18.0
    contrast: float = 0.2

    def view(self, eye: ViewOffset) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Colours (H, W, 3) and disparity (H, W) seen from an eye, pixel centres only."""
        y, x = np.indices((self.height, self.width)).astype(float)
        far = self._texture(x + self.background * eye.s, y + self.background * eye.t, hue=0.0)
        near = self._texture(x + self.foreground * eye.s, y + self.foreground * eye.t, hue=2.0)
        centre_x, centre_y = self.width / 2 - self.foreground * eye.s, self.height / 2 - self.foreground * eye.t
        in_front = np.hypot(x - centre_x, y - centre_y) < self.radius_px
        colors = np.where(in_front[..., None], near, far)
        disparity = np.where(in_front, self.foreground, self.background).astype(np.float32)
        return np.rint(colors * 255).astype(np.uint8), disparity

    def _texture(self, x: NDArray[np.float64], y: NDArray[np.float64], hue: float) -> NDArray[np.float64]:
        waves = [np.sin(0.31 * x + 0.17 * y + hue), np.sin(0.11 * x - 0.29 * y + 2 * hue), np.sin(0.23 * y + hue)]
        return 0.5 + self.contrast * np.stack(waves, axis=-1) + 0.1 * np.cos(hue)

    def open(self, renderer: Renderer, grid: GridShape, with_disparity: bool = True) -> None:
        """Open an empty field of this scene's size."""
        renderer.open_field(grid, self.width, self.height, hdr=False, with_disparity=with_disparity)

    def upload(self, renderer: Renderer, grid: GridShape, row: int, column: int, with_disparity: bool = True) -> None:
        """Upload one view."""
        colors, disparity = self.view(grid.offset(row, column))
        renderer.upload_view(row, column, colors, disparity if with_disparity else None)

    def fill(self, renderer: Renderer, grid: GridShape, with_disparity: bool = True) -> None:
        """Open the field and upload every view."""
        self.open(renderer, grid, with_disparity)
        for row in range(grid.rows):
            for column in range(grid.columns):
                self.upload(renderer, grid, row, column, with_disparity)


def through_aperture(
    scene: TwoPlanes, offsets: list[ViewOffset], weights: list[float], eye: ViewOffset, focus: float
) -> NDArray[np.uint8]:
    """Twin of the aperture pass: the plain weighted mean, in linear light, of views moved by whole pixels."""
    total = np.zeros((scene.height, scene.width, 3))
    for offset, weight in zip(offsets, weights):
        light = linear_from_srgb(scene.view(offset)[0] / 255)
        moved = round(focus * (offset.t - eye.t)), round(focus * (offset.s - eye.s))
        total += weight * np.roll(light, moved, axis=(0, 1))
    return np.rint(srgb_from_linear(total / sum(weights)) * 255).astype(np.uint8)


def rms(image: NDArray[np.uint8], expected: NDArray[np.uint8], border: int = 8) -> float:
    """Root mean square difference inside the border, 1 = white."""
    inside = slice(border, -border)
    difference = image[inside, inside].astype(float) - expected[inside, inside]
    return float(np.sqrt(np.mean(difference**2)) / 255)
