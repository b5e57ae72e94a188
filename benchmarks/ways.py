"""Ways to make views of a photo with a map: ours, and what people use instead.

Every way takes a scene and returns a function from a viewpoint to the view (H, W, 3), sRGB-encoded. Other ways fill
gaps from the background, as the published ones leave that to a network or to the user.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import floor

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import Scene
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.warp import SAME_SURFACE, SAMPLES, fill_holes
from iibr_core.method.light_field import ViewMaker
from iibr_core.runtime.kernels import kernel
from iibr_core.stages import ALL_STAGES, STAGE_NAMES, Stages, stages_without
from iibr_core.types import FloatImage, InputError, ViewOffset

MakeView = Callable[[ViewOffset], FloatImage]
Way = Callable[[Scene], MakeView]
PLANES = 32
BEHIND_PX = 24
"""Distance over which planes continue behind nearer ones."""
SHARPNESS = 20.0
"""Factor of the softmax's exponent, per pixel of parallax."""


def iibr(scene: Scene, stages: Stages = ALL_STAGES, refines: bool = True) -> MakeView:
    """Return our views, with all stages or some. refines: the map's edges are drawn to the photo's."""
    disparity = scene.disparity
    if refines:
        disparity = refine(scene.photo, disparity, stages=stages, is_enlarged=scene.is_enlarged)
    views = ViewMaker(scene.photo, disparity, scene.field, stages=stages)
    _ = views.rays  # made now: `compare` counts the time of this once
    return lambda at: views.view(at).colors


def unchanged(scene: Scene) -> MakeView:
    """Return the photo for every view."""
    return lambda at: scene.photo


def warp(scene: Scene) -> MakeView:
    """Return forward-warped views: the nearest surface that lands, OpenCV's bicubic colours, holes from behind."""

    def view(at: ViewOffset) -> FloatImage:
        nearest, hole = land(scene.disparity, at)
        colors = np.clip(_looked_up(scene.photo, nearest, at, cv2.INTER_CUBIC), 0, 1)
        return np.asarray(fill_holes(colors, hole, nearest), np.float32)

    return view


def land(disparity: FloatImage, at: ViewOffset) -> tuple[FloatImage, NDArray[np.bool_]]:
    """Return the disparity (H, W) that a view sees, 0 in holes, and the holes (H, W): what the photo does not show."""
    height, width = disparity.shape
    nearest = _land(np.ascontiguousarray(disparity, np.float32), float(at.t), float(at.s))
    hole = np.isneginf(nearest)
    nearest[hole] = 0
    y, x = np.indices(disparity.shape, np.float32)
    from_x, from_y = x + nearest * at.s, y + nearest * at.t
    hole |= (from_x < -0.5) | (from_y < -0.5) | (from_x > width - 0.5) | (from_y > height - 0.5)
    return nearest, hole


def _looked_up(photo: FloatImage, disparity: FloatImage, at: ViewOffset, interpolation: int) -> FloatImage:
    """Return the photo's colours (H, W, 3) at the places that a view with this disparity (H, W) sees."""
    y, x = np.indices(disparity.shape, np.float32)
    from_x, from_y = x + disparity * np.float32(at.s), y + disparity * np.float32(at.t)
    return np.asarray(cv2.remap(photo, from_x, from_y, interpolation, borderMode=cv2.BORDER_REPLICATE))


def ray_march(scene: Scene) -> MakeView:
    """Return views of a parallax shader, as of DepthFlow (Tremeschin): rays step through the map as through a relief.

    They march from the nearest plane backwards, first in coarse steps, then in fine ones; the relief has walls, so
    disocclusions show them stretched. https://github.com/BrokenSource/DepthFlow
    """
    relief = np.ascontiguousarray(scene.disparity, np.float32)

    def view(at: ViewOffset) -> FloatImage:
        steps = max(int(np.ceil(np.ptp(relief) * max(abs(at.t), abs(at.s)))), 1)
        met = _march(relief, float(at.t), float(at.s), float(relief.max()), float(relief.min()), steps)
        return _looked_up(scene.photo, met, at, cv2.INTER_LINEAR)

    return view


def splatting(scene: Scene, dilated_px: int = 0) -> MakeView:
    """Return views by softmax splatting (Niklaus and Liu, CVPR 2020): pixels weighed by the exponential of nearness.

    dilated_px: growth of the foreground, as stereo converters (iw3, "forward fill") have it.
    https://github.com/sniklaus/softmax-splatting https://github.com/nagadomi/nunif
    """
    surface = np.asarray(cv2.dilate(scene.disparity, np.ones((2 * dilated_px + 1,) * 2, np.uint8)), np.float32)
    values = np.dstack([scene.photo, surface, np.ones_like(surface)]).astype(np.float32)

    def view(at: ViewOffset) -> FloatImage:
        means, area = _splat(values, float(at.t), float(at.s))
        return np.asarray(fill_holes(means[..., :3], area < 0.25, means[..., 3]))

    return view


def planes(scene: Scene) -> MakeView:
    """Return views of 32 planes with soft alpha (multiplane images; Tucker and Snavely, CVPR 2020), made of the map.

    Each pixel is shared by the two planes next to its disparity. Planes continue behind nearer ones with colours of
    the background; a view lays them over one another from back to front, each moved as a whole, bilinear.
    """
    far, near = float(scene.disparity.min()), float(scene.disparity.max())
    place = ((scene.disparity - far) * ((PLANES - 1) / max(near - far, 1e-9))).astype(np.float32)
    layers = np.zeros((PLANES, *place.shape, 4), np.float32)
    layers[..., :3] = scene.photo
    for k in range(PLANES):
        # All of it if a nearer plane shares it: the nearer one, laid over it, then adds up to the pixel.
        layers[k, ..., 3] = np.where(place > k, place < k + 1, np.clip(1 - np.abs(place - k), 0, 1))
    _continue_behind(layers, place)
    layers[..., :3] *= layers[..., 3:]

    def view(at: ViewOffset) -> FloatImage:
        sums = np.zeros(layers.shape[1:], np.float32)
        for layer, level in zip(layers, np.linspace(far, near, PLANES)):
            shift = np.array([[1, 0, -level * at.s], [0, 1, -level * at.t]])
            moved = cv2.warpAffine(layer, shift, layer.shape[1::-1], flags=cv2.INTER_LINEAR)
            _lay_over(moved, sums)
        colors, alpha = sums[..., :3] / np.maximum(sums[..., 3:], 1e-6), sums[..., 3]
        return np.asarray(fill_holes(colors, alpha < 0.5, np.zeros_like(alpha)))

    return view


WAYS: dict[str, Way] = {
    "iibr": iibr,
    "iibr map not refined": partial(iibr, refines=False),
    "plain warp": warp,
    "ray march (DepthFlow)": ray_march,
    "dilated forward warp (iw3)": partial(splatting, dilated_px=2),
    "softmax splatting": splatting,
    "32 planes (MPI)": planes,
    "unchanged photo": unchanged,
    **{f"iibr without {name}": partial(iibr, stages=stages_without([name])) for name in STAGE_NAMES},
}


def chosen_ways(words: str) -> dict[str, Way]:
    """Return the ways that begin with one of these words, in their order. Raises InputError for a word of none."""
    found: dict[str, Way] = {}
    for word in words.split(","):
        names = [word] if word in WAYS else [name for name in WAYS if name.startswith(word)]
        if not names:
            raise InputError(f"{word!r} is no way to make views; give some of: {'; '.join(WAYS)}")
        found |= {name: WAYS[name] for name in names}
    return found


@kernel
def _land(disparity, t, s):
    """Return the largest disparity (H, W) that lands on each pixel of the view at (t, s), else -inf."""
    height, width = disparity.shape
    nearest = np.full((height, width), -np.inf, np.float32)
    for y in range(height):
        for x in range(width):
            for j in range(SAMPLES):
                for i in range(SAMPLES):
                    point_x, point_y = x + (i + 0.5) / SAMPLES - 0.5, y + (j + 0.5) / SAMPLES - 0.5
                    left, top, value = floor(point_x), floor(point_y), disparity[y, x]
                    if 0 <= left < width - 1 and 0 <= top < height - 1:
                        a, b = disparity[top, left], disparity[top, left + 1]
                        c, d = disparity[top + 1, left], disparity[top + 1, left + 1]
                        if max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) < SAME_SURFACE:
                            across, down = point_x - left, point_y - top
                            upper, lower = a * (1 - across) + b * across, c * (1 - across) + d * across
                            value = upper * (1 - down) + lower * down
                    u, v = floor(point_x - value * s + 0.5), floor(point_y - value * t + 0.5)
                    if 0 <= u < width and 0 <= v < height and value > nearest[v, u]:
                        nearest[v, u] = value
    return nearest


@kernel
def _height_at(relief, y, x):
    """Return the relief at a place, bilinear, its border repeated."""
    height, width = relief.shape
    y, x = min(max(y, 0.0), height - 1.001), min(max(x, 0.0), width - 1.001)
    v, u = int(y), int(x)
    down, across = y - v, x - u
    upper = (1 - across) * relief[v, u] + across * relief[v, u + 1]
    lower = (1 - across) * relief[v + 1, u] + across * relief[v + 1, u + 1]
    return (1 - down) * upper + down * lower


@kernel
def _march(relief, t, s, near, far, steps):
    """Return the disparity (H, W) at which each ray of a view meets the relief."""
    met = np.empty(relief.shape, np.float32)
    for y in range(relief.shape[0]):
        for x in range(relief.shape[1]):
            before, after = near, far
            for k in range(1, steps + 1):
                level = near + (far - near) * k / steps
                if _height_at(relief, y + level * t, x + level * s) >= level:
                    after = level
                    break
                before = level
            for _ in range(4):
                middle = 0.5 * (before + after)
                if _height_at(relief, y + middle * t, x + middle * s) >= middle:
                    after = middle
                else:
                    before = middle
            met[y, x] = after
    return met


@kernel
def _splat(values, t, s):
    """Return the means (H, W, 5) of values, weighed by nearness, that land on each pixel, and the area of what lands.

    values: (H, W, 5), colours, disparity and 1.
    """
    height, width, _ = values.shape
    front, parallax = np.full((height, width), -np.inf, np.float32), max(abs(t), abs(s))
    sums, area = np.zeros(values.shape, np.float32), np.zeros((height, width), np.float32)
    # The first pass finds the front-most disparity of each pixel, which keeps the exponentials small.
    for is_second in range(2):
        for y in range(height):
            for x in range(width):
                d = values[y, x, 3]
                row, column = y - d * t, x - d * s
                v, u = floor(row), floor(column)
                for j in range(max(v, 0), min(v + 2, height)):
                    for i in range(max(u, 0), min(u + 2, width)):
                        if not is_second:
                            front[j, i] = max(front[j, i], d)
                            continue
                        share = (1 - abs(row - j)) * (1 - abs(column - i))
                        weight = share * np.exp(SHARPNESS * parallax * (d - front[j, i]))
                        area[j, i] += share
                        for c in range(5):
                            sums[j, i, c] += weight * values[y, x, c]
    for y in range(height):
        for x in range(width):
            sums[y, x] /= max(sums[y, x, 4], np.float32(1e-6))
    return sums, area


@kernel
def _continue_behind(layers, place):
    """Continue planes row by row behind nearer ones, with the colour where they were last seen."""
    _, height, width, _ = layers.shape
    for y in range(height):
        for direction in (1, -1):
            begin, end = (0, width) if direction == 1 else (width - 1, -1)
            last = begin
            for x in range(begin, end, direction):
                here, before = place[y, x], place[y, last]
                if here - before > 2.0 and abs(x - last) <= BEHIND_PX:
                    k = int(before)
                    if layers[k, y, x, 3] == 0:
                        for c in range(3):
                            layers[k, y, x, c] = layers[k, y, last, c]
                        layers[k, y, x, 3] = 1.0
                else:
                    last = x


@kernel
def _lay_over(layer, sums):
    """Lay a layer over sums (H, W, 4): colours times alpha, and alpha."""
    for y in range(sums.shape[0]):
        for x in range(sums.shape[1]):
            seen = 1 - layer[y, x, 3]
            for c in range(4):
                sums[y, x, c] = layer[y, x, c] + seen * sums[y, x, c]
