"""Small scenes with known answers."""

from collections.abc import Generator

import numpy as np

from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.method.light_field import view_maker
from iibr_core.method.plan import ScenePlan, plan_literal
from iibr_core.types import Disparity, GridShape, Photo, ViewUpdate


def smooth_texture(height: int, width: int, seed: int = 0) -> np.ndarray:
    """(H, W, 3) in 0.2 .. 0.8 without detail finer than some ten pixels, so that resampling it is nearly exact."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (3, 4))
    y, x = np.mgrid[0:height, 0:width]
    waves = [
        sum(np.sin(x * 0.11 * k + p) + np.cos(y * 0.13 * k + 2 * p) for k, p in enumerate(phase, 1)) for phase in phases
    ]
    return (0.5 + 0.3 * np.stack(waves, axis=-1) / 8).astype(np.float32)


def bilinear(image: np.ndarray, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return an image (H, W) or (H, W, C) at places (h, w) between its pixels."""
    top, left = np.floor(y).astype(int), np.floor(x).astype(int)
    down, across = (part.reshape(*part.shape, *[1] * (image.ndim - 2)) for part in (y - top, x - left))
    above = image[top, left] * (1 - across) + image[top, left + 1] * across
    below = image[top + 1, left] * (1 - across) + image[top + 1, left + 1] * across
    return above * (1 - down) + below * down


def photo_of(pixels: np.ndarray, is_hdr: bool = False) -> Photo:
    return Photo(np.asarray(pixels, np.float32), focal_px=100.0, name="test", is_hdr=is_hdr)


def disparity_of(values: np.ndarray) -> Disparity:
    return Disparity(np.asarray(values, np.float32), "test")


def square_before_wall(height=60, width=80, foreground=2.0, background=0.0):
    """A reddish square in front of a bluish, smoothly textured wall; no mixed pixels."""
    pixels = smooth_texture(height, width) * np.float32([0.3, 0.5, 1.0])
    disparity = np.full((height, width), background, np.float32)
    square = np.s_[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3]
    pixels[square] = (smooth_texture(height, width, 1) * np.float32([1.0, 0.4, 0.2]))[square]
    disparity[square] = foreground
    return photo_of(pixels), disparity_of(disparity)


def literal_plan(photo: Photo, disparity: Disparity, rows: int, columns: int | None = None) -> ScenePlan:
    return plan_literal(photo, disparity, GridShape(rows, columns or rows))


def by_index(updates: list[ViewUpdate]) -> dict[tuple[int, int], ViewUpdate]:
    return {(update.row, update.column): update for update in updates}


def generate(photo: Photo, disparity: Disparity, plan: ScenePlan, inpaint=DEFAULT_INPAINTER, **options) -> Generator:
    """Yield the views of a plan. options: those of `ViewMaker.generate`."""
    return view_maker(photo, disparity, plan, inpaint).generate(plan.grid, photo.is_hdr, **options)
