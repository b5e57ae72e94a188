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
from iibr_core.evaluation.warp import fill_holes
from iibr_core.method.photo_views import PhotoViews
from iibr_core.runtime.kernels import kernel
from iibr_core.stages import ALL_STAGES, STAGE_NAMES, Stages, stages_without
from iibr_core.types import FloatImage, InputError, ViewOffset

ViewMaker = Callable[[ViewOffset], FloatImage]
Way = Callable[[Scene], ViewMaker]
NOWHERE = -1e30
"""Disparity of a pixel on which nothing lands."""
SAME_SURFACE = 0.08
"""Difference of disparity, in px per view step, below which neighbours are one surface."""
SAMPLES = 3
"""Points in each direction as which a pixel is warped, so that stretched surfaces stay closed."""
PLANES = 32
BEHIND_PX = 24
"""Distance over which planes continue behind nearer ones."""
SHARPNESS = 20.0
"""Factor of the softmax's exponent, per pixel of parallax."""
BISECTIONS = 4
"""Number of fine steps of the ray march."""


def iibr(scene: Scene, stages: Stages = ALL_STAGES) -> ViewMaker:
    """Return our views, with all stages or some."""
    disparity = refine(scene.photo, scene.disparity, stages=stages, is_enlarged=scene.is_enlarged)
    views = PhotoViews(scene.photo, disparity, scene.field, stages)
    return lambda at: views.view(at).colors


def without_refining(scene: Scene) -> ViewMaker:
    """Return our views of the map as given."""
    views = PhotoViews(scene.photo, scene.disparity, scene.field)
    return lambda at: views.view(at).colors


def unchanged(scene: Scene) -> ViewMaker:
    """Return the photo for every view."""
    return lambda at: scene.photo


def warp(scene: Scene) -> ViewMaker:
    """Return forward-warped views: the nearest surface that lands, OpenCV's bicubic colours, holes from behind."""
    photo, disparity = _arrays(scene)
    y, x = np.indices(disparity.shape, np.float32)

    def view(at: ViewOffset) -> FloatImage:
        nearest, hole = land(disparity, at)
        from_x, from_y = x + nearest * np.float32(at.s), y + nearest * np.float32(at.t)
        colors = cv2.remap(photo, from_x, from_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(fill_holes(np.clip(colors, 0, 1), hole, nearest), np.float32)

    return view


def land(disparity: FloatImage, at: ViewOffset) -> tuple[FloatImage, NDArray[np.bool_]]:
    """Return the disparity (H, W) that a view sees, 0 in holes, and the holes (H, W): what the photo does not show."""
    height, width = disparity.shape
    nearest = _land(disparity, float(at.t), float(at.s))
    hole = nearest == NOWHERE
    nearest[hole] = 0
    y, x = np.indices(disparity.shape, np.float32)
    from_x, from_y = x + nearest * at.s, y + nearest * at.t
    hole |= (from_x < -0.5) | (from_y < -0.5) | (from_x > width - 0.5) | (from_y > height - 0.5)
    return nearest, hole


def ray_march(scene: Scene) -> ViewMaker:
    """Return views of a parallax shader, as of DepthFlow (Tremeschin): rays step through the map as through a relief.

    They march from the nearest plane backwards, first in coarse steps, then in fine ones; the relief has walls, so
    disocclusions show them stretched. https://github.com/BrokenSource/DepthFlow
    """
    photo, relief = _arrays(scene)
    near, far = float(relief.max()), float(relief.min())

    def view(at: ViewOffset) -> FloatImage:
        result = np.empty_like(photo)
        steps = max(int(np.ceil((near - far) * max(abs(at.t), abs(at.s)))), 1)
        _march(photo, relief, float(at.t), float(at.s), near, far, steps, result)
        return result

    return view


def splatting(scene: Scene, dilated_px: int = 0) -> ViewMaker:
    """Return views by softmax splatting (Niklaus and Liu, CVPR 2020): pixels weighed by the exponential of nearness.

    dilated_px: growth of the foreground, as stereo converters (iw3, "forward fill") have it.
    https://github.com/sniklaus/softmax-splatting https://github.com/nagadomi/nunif
    """
    photo, disparity = _arrays(scene)
    disparity = np.asarray(cv2.dilate(disparity, np.ones((2 * dilated_px + 1,) * 2, np.uint8)), np.float32)

    def view(at: ViewOffset) -> FloatImage:
        front = np.full(disparity.shape, -np.inf, np.float32)
        colors, weight, depth = np.zeros_like(photo), np.zeros_like(disparity), np.zeros_like(disparity)
        _splat(photo, disparity, float(at.t), float(at.s), front, colors, weight, depth)
        return np.asarray(fill_holes(colors, weight < 0.25, depth))

    return view


def planes(scene: Scene) -> ViewMaker:
    """Return views of 32 planes with soft alpha (multiplane images; Tucker and Snavely, CVPR 2020), made of the map.

    Each pixel is shared by the two planes next to its disparity. Planes continue behind nearer ones with colours of
    the background; a view lays them over one another from back to front, each moved as a whole, bilinear.
    """
    photo, disparity = _arrays(scene)
    far, near = float(disparity.min()), float(disparity.max())
    levels = np.linspace(far, near, PLANES).astype(np.float32)
    place = (disparity - far) * np.float32((PLANES - 1) / max(near - far, 1e-9))
    layers = np.zeros((PLANES, *disparity.shape, 4), np.float32)
    for k in range(PLANES):
        share = np.clip(1 - np.abs(place - k), 0, 1)
        # All of it if a nearer plane shares it: the nearer one, laid over it, then adds up to the pixel.
        layers[k, ..., 3] = np.where(place > k, share > 0, share)
        layers[k, ..., :3] = photo
    _continue_behind(layers, place)

    def view(at: ViewOffset) -> FloatImage:
        colors, alpha = np.zeros(photo.shape, np.float32), np.zeros(disparity.shape, np.float32)
        _lay_over(layers, levels, float(at.t), float(at.s), colors, alpha)
        return np.asarray(fill_holes(colors / np.maximum(alpha, 1e-6)[..., None], alpha < 0.5, np.zeros_like(alpha)))

    return view


WAYS: dict[str, Way] = {
    "iibr": iibr,
    "iibr map not refined": without_refining,
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


def _arrays(scene: Scene) -> tuple[FloatImage, FloatImage]:
    return np.ascontiguousarray(scene.photo, np.float32), np.ascontiguousarray(scene.disparity, np.float32)


@kernel
def _land(disparity, t, s):
    """The largest disparity (H, W) that lands on each pixel of the view at (t, s), else NOWHERE."""
    height, width = disparity.shape
    nearest = np.full((height, width), NOWHERE, np.float32)
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
def _between(relief, y, x):
    """The relief at a place, bilinear, its border repeated; and the place, clamped to the relief."""
    height, width = relief.shape
    y, x = min(max(y, 0.0), height - 1.001), min(max(x, 0.0), width - 1.001)
    v, u = int(y), int(x)
    down, across = y - v, x - u
    upper = (1 - across) * relief[v, u] + across * relief[v, u + 1]
    lower = (1 - across) * relief[v + 1, u] + across * relief[v + 1, u + 1]
    return (1 - down) * upper + down * lower, v, u, down, across


@kernel
def _march(photo, relief, t, s, near, far, steps, result):
    for y in range(relief.shape[0]):
        for x in range(relief.shape[1]):
            before, after = near, far
            for k in range(1, steps + 1):
                level = near + (far - near) * k / steps
                if _between(relief, y + level * t, x + level * s)[0] >= level:
                    after = level
                    break
                before = level
            for _ in range(BISECTIONS):
                middle = 0.5 * (before + after)
                if _between(relief, y + middle * t, x + middle * s)[0] >= middle:
                    after = middle
                else:
                    before = middle
            _, v, u, down, across = _between(relief, y + after * t, x + after * s)
            for c in range(3):
                upper = (1 - across) * photo[v, u, c] + across * photo[v, u + 1, c]
                lower = (1 - across) * photo[v + 1, u, c] + across * photo[v + 1, u + 1, c]
                result[y, x, c] = (1 - down) * upper + down * lower


@kernel
def _splat(photo, surface, t, s, front, colors, weight, depth):
    height, width = surface.shape
    parallax = max(abs(t), abs(s))
    solid = np.zeros(surface.shape, np.float32)
    # The first pass finds the front-most disparity of each pixel, which keeps the exponentials small.
    for is_second in range(2):
        for y in range(height):
            for x in range(width):
                d = surface[y, x]
                row, column = y - d * t, x - d * s
                v, u = floor(row), floor(column)
                for j in range(max(v, 0), min(v + 2, height)):
                    for i in range(max(u, 0), min(u + 2, width)):
                        if not is_second:
                            front[j, i] = max(front[j, i], d)
                            continue
                        area = (1 - abs(row - j)) * (1 - abs(column - i))
                        w = area * np.exp(SHARPNESS * parallax * (d - front[j, i]))
                        solid[j, i] += w
                        weight[j, i] += area
                        depth[j, i] += w * d
                        for c in range(3):
                            colors[j, i, c] += w * photo[y, x, c]
    for y in range(height):
        for x in range(width):
            whole = max(solid[y, x], np.float32(1e-6))
            depth[y, x] /= whole
            for c in range(3):
                colors[y, x, c] /= whole


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
def _lay_over(layers, levels, t, s, colors, alpha):
    height, width = alpha.shape
    for k in range(len(levels)):
        for y in range(height):
            row = y + levels[k] * t
            v = floor(row)
            if v < 0 or v + 1 >= height:
                continue
            fy = np.float32(row - v)
            for x in range(width):
                column = x + levels[k] * s
                u = floor(column)
                if u < 0 or u + 1 >= width:
                    continue
                fx = np.float32(column - u)
                a, b = (1 - fy) * (1 - fx) * layers[k, v, u, 3], (1 - fy) * fx * layers[k, v, u + 1, 3]
                c, d = fy * (1 - fx) * layers[k, v + 1, u, 3], fy * fx * layers[k, v + 1, u + 1, 3]
                total = a + b + c + d
                if total > 0:
                    for i in range(3):
                        color = a * layers[k, v, u, i] + b * layers[k, v, u + 1, i]
                        color += c * layers[k, v + 1, u, i] + d * layers[k, v + 1, u + 1, i]
                        colors[y, x, i] = color + (1 - total) * colors[y, x, i]
                    alpha[y, x] = total + (1 - total) * alpha[y, x]
