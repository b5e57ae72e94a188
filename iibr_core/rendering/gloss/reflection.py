"""What a glossy photo already shows of reflections: told apart from the matt part, and where it is seen in other views.

A reflection is seen as an image behind or before its surface. On the EPI it does not follow the surface's line, so the
position of its source ray is distorted before it is looked up: that of a plane lies as far as what it reflects, that of
a sphere half its radius behind it. To first order, both follow from how the reflected direction turns as the place on
the surface moves (its curvature) and as the eye moves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.gloss.geometry import SceneGeometry
from iibr_core.types import FloatImage

MOST_TURN = 3.0
"""A reflection runs over its surface at most so many times as fast as one in a plane: beyond, it is a caustic."""
FLATTEST = 0.05
"""Of the turn that a plane's reflection has over a pixel: what turns less, in any direction, counts as turning so."""
FIT_ROUNDS = 12
CLEAR_DEVIATIONS = 5.0
"""What lies so many deviations above the matt part is reflected."""
MOST_FITTED = 20_000
"""Pixels that the matt part is fitted to."""
RIDGE = 1e-4
CLIPPED = 0.97
"""Of white, linear: brighter pixels of a photo may have been brighter still."""
HIGHLIGHT = 0.7
"""Of white, linear, in every channel: paint is hardly ever so bright."""
RIM_PX = 2


def reflection_disparity(disparity: FloatImage, normals: FloatImage, geometry: SceneGeometry) -> FloatImage:
    """Virtual disparity (H, W, 2, 2), px per view step, of what is reflected at each pixel: what is reflected there in
    the photo is seen at (x, y) - M (s, t) in view (t, s). M is `disparity` itself for what is painted on the surface.

    disparity: (H, W); normals: (H, W, 3). What is reflected counts as infinitely far.
    """
    points = _points(disparity, geometry)
    here = _reflected(points, normals, np.zeros(3, np.float32))
    turn = np.stack([_across(here), _down(here)], axis=-1)  # (H, W, 3, 2): per pixel
    by_eye = np.stack(
        [_reflected(points, normals, np.array(step, np.float32)) - here for step in ((1, 0, 0), (0, 1, 0))], axis=-1
    )  # per view step
    # least squares of turn . moved = -by_eye
    normal_matrix = np.swapaxes(turn, -1, -2) @ turn
    near = geometry.nearness(disparity)
    least = (FLATTEST / geometry.focal_px) ** 2
    normal_matrix[..., 0, 0] += least
    normal_matrix[..., 1, 1] += least
    moved = -np.linalg.solve(normal_matrix, np.swapaxes(turn, -1, -2) @ by_eye)
    speed = np.sqrt((moved**2).sum(axis=(-1, -2), keepdims=True))
    moved *= np.minimum(1, MOST_TURN * near[..., None, None] / np.maximum(speed, 1e-12))
    own = disparity[..., None, None] * np.eye(2, dtype=np.float32)
    return np.asarray(own - moved, np.float32)


def separate_light(
    linear: FloatImage, normals: FloatImage, mask: FloatImage, lobe: FloatImage
) -> tuple[FloatImage, FloatImage]:
    """(color, reflected): how strong a light is that a photo shows reflected, (3,), and how much each pixel shows of
    it, (H, W, 3) linear light.

    linear: (H, W, 3); normals: (H, W, 3); mask: (H, W), 0..1; lobe: (H, W), what a white light of strength 1 adds.
    Under any light, a matt surface of one colour is a quadratic form of its normal (Ramamoorthi and Hanrahan 2001): the
    lobe is fitted beside that, where the photo is not clipped. A light that is not clearly there is black.
    """
    terms, colors, amount = _harmonics(normals.reshape(-1, 3)), linear.reshape(-1, 3), lobe.reshape(-1)
    inside = (mask.reshape(-1) > 0.5) & (colors.max(axis=1) < CLIPPED)
    chosen = np.flatnonzero(inside)[:: max(-(-int(inside.sum()) // MOST_FITTED), 1)]
    if len(chosen) <= terms.shape[1] or not amount[chosen].any():
        return np.zeros(3, np.float32), np.zeros_like(linear)
    unknowns = np.concatenate([terms[chosen], amount[chosen, None] / amount[chosen].max()], axis=1).astype(np.float64)
    system = unknowns.T @ unknowns + RIDGE * len(chosen) * np.eye(unknowns.shape[1])
    weights = np.linalg.solve(system, unknowns.T @ colors[chosen])
    rest = colors[chosen] - unknowns @ weights
    deviation = np.sqrt((rest**2).mean(axis=0) * np.linalg.inv(system)[-1, -1])
    strength = np.where(weights[-1] > CLEAR_DEVIATIONS * deviation, weights[-1], 0) / amount[chosen].max()
    color = strength.astype(np.float32)
    # where the photo is clipped nothing is known but that the matt part is none of the light
    matt = colors - color * amount[:, None]
    usual = terms @ weights[:-1].astype(np.float32)
    matt = np.where(colors < CLIPPED, matt, np.maximum(matt, usual))
    reflected = np.clip(colors - np.maximum(matt, 0), 0, color * amount[:, None]) * mask.reshape(-1, 1)
    return color, np.asarray(reflected.reshape(linear.shape), np.float32)


def reflected_light(linear: FloatImage, normals: FloatImage, mask: FloatImage) -> FloatImage:
    """Linear light (H, W, 3) that a photo shows reflected, of whatever there is: 0 outside the mask.

    Arrays as in `separate_light`. The matt part is fitted to what is not brighter than it; what is clearly brighter in
    every channel, as highlights are, is reflected. Without anything nearly white, nothing is told from bright paint.
    """
    inner = _eroded(np.asarray(mask > 0.5))
    inside = np.flatnonzero(inner)
    if not len(inside) or linear.min(axis=2)[inner].max() < HIGHLIGHT:
        return np.zeros_like(linear)
    fitted = inside[:: -(-len(inside) // MOST_FITTED)]
    terms, colors = _harmonics(normals.reshape(-1, 3)), linear.reshape(-1, 3)
    above = np.empty_like(colors)
    for channel in range(3):
        weights, deviation = _lower_fit(terms[fitted], colors[fitted, channel])
        above[:, channel] = colors[:, channel] - np.maximum(terms @ weights, 0) - CLEAR_DEVIATIONS * deviation
    light = np.clip(above, 0, colors) * np.all(above > 0, axis=1, keepdims=True)
    return np.asarray(light.reshape(linear.shape) * (mask * inner)[..., None], np.float32)


def _eroded(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Without RIM_PX at its edges, where pixels mix it with what is beside it: (H, W)."""
    inner: NDArray[np.bool_] = np.pad(mask, RIM_PX, mode="edge")
    for axis in (0, 1):
        count = inner.shape[axis] - 2 * RIM_PX
        inner = np.all([inner.take(range(k, k + count), axis) for k in range(2 * RIM_PX + 1)], axis=0)
    return inner


def _lower_fit(terms: FloatImage, values: FloatImage) -> tuple[FloatImage, float]:
    """(weights, deviation) of the values that are not clearly above the fit: (N, K) and (N,) -> (K,)."""
    kept = np.ones(len(values), np.bool_)
    weights, deviation = np.zeros(terms.shape[1], np.float32), 0.0
    for _ in range(FIT_ROUNDS):
        chosen = terms[kept].astype(np.float64)
        system = chosen.T @ chosen + RIDGE * len(chosen) * np.eye(terms.shape[1])
        weights = np.linalg.solve(system, chosen.T @ values[kept]).astype(np.float32)
        rest = values - terms @ weights
        below = rest[rest <= 0]
        deviation = float(1.4826 * np.median(-below)) + 1e-4 if len(below) else 1e-4
        now = rest <= 2 * deviation
        if now.sum() < terms.shape[1] or (now == kept).all():
            break
        kept = now
    return weights, deviation


def _harmonics(normals: FloatImage) -> FloatImage:
    """(N, 3) -> (N, 9): the spherical harmonics up to the second order, unscaled."""
    x, y, z = normals.T
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, x * z, x * x - y * y, 3 * z * z - 1], axis=1)


def _points(disparity: FloatImage, geometry: SceneGeometry) -> FloatImage:
    """Points (H, W, 3) in view steps; see `iibr_core.rendering.gloss.geometry`."""
    height, width = disparity.shape
    y, x = np.mgrid[:height, :width].astype(np.float32)
    ray = np.stack([x - (width - 1) / 2, y - (height - 1) / 2, np.full_like(x, geometry.focal_px)], axis=-1)
    return np.asarray(ray / geometry.nearness(disparity)[..., None], np.float32)


def _reflected(points: FloatImage, normals: FloatImage, eye: FloatImage) -> FloatImage:
    """Unit directions (H, W, 3) from which light comes that is reflected into an eye."""
    away = points - eye
    away /= np.linalg.norm(away, axis=-1, keepdims=True)
    return np.asarray(away - 2 * (away * normals).sum(axis=-1, keepdims=True) * normals, np.float32)


def _across(values: FloatImage) -> FloatImage:
    return np.gradient(values, axis=1) if values.shape[1] > 1 else np.zeros_like(values)


def _down(values: FloatImage) -> FloatImage:
    return np.gradient(values, axis=0) if values.shape[0] > 1 else np.zeros_like(values)
