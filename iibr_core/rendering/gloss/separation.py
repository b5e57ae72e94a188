"""Separates the reflected light in a glossy photo from its matt part.

Under any light, a matt surface of one colour is a quadratic form of its normal (Ramamoorthi and Hanrahan 2001).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage

FIT_ROUNDS = 12
CLEAR_DEVIATIONS = 5.0
"""What lies so many deviations above the matt part is reflected."""
MOST_MATT_PIXELS = 20_000
"""Pixels that the matt part is fitted to."""
RIDGE = 1e-4
CLIPPED = 0.97
"""Of white, linear: brighter pixels of a photo may have been brighter still."""
HIGHLIGHT = 0.7
"""Of white, linear, in every channel: paint is hardly ever so bright."""
EDGE_BAND_PX = 2


def separate_light(
    linear: FloatImage, normals: FloatImage, mask: FloatImage, lobe: FloatImage
) -> tuple[FloatImage, FloatImage]:
    """(color, reflected): how strong a light is that a photo shows reflected, (3,), and how much each pixel shows of
    it, (H, W, 3) linear light.

    linear: (H, W, 3); normals: (H, W, 3); mask: (H, W), 0..1; lobe: (H, W), what a white light of strength 1 adds.
    Under any light, a matt surface of one colour is a quadratic form of its normal (Ramamoorthi and Hanrahan 2001): the
    lobe is fitted beside that, where the photo is not clipped. A light that is not clearly there is black.
    """
    terms, colors, amount = harmonics(normals.reshape(-1, 3)), linear.reshape(-1, 3), lobe.reshape(-1)
    inside = (mask.reshape(-1) > 0.5) & (colors.max(axis=1) < CLIPPED)
    chosen = np.flatnonzero(inside)[:: max(-(-int(inside.sum()) // MOST_MATT_PIXELS), 1)]
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
    inner = eroded(np.asarray(mask > 0.5))
    inside = np.flatnonzero(inner)
    if not len(inside) or linear.min(axis=2)[inner].max() < HIGHLIGHT:
        return np.zeros_like(linear)
    fitted = inside[:: -(-len(inside) // MOST_MATT_PIXELS)]
    terms, colors = harmonics(normals.reshape(-1, 3)), linear.reshape(-1, 3)
    above = np.empty_like(colors)
    for channel in range(3):
        weights, deviation = _lower_fit(terms[fitted], colors[fitted, channel])
        above[:, channel] = colors[:, channel] - np.maximum(terms @ weights, 0) - CLEAR_DEVIATIONS * deviation
    light = np.clip(above, 0, colors) * np.all(above > 0, axis=1, keepdims=True)
    return np.asarray(light.reshape(linear.shape) * (mask * inner)[..., None], np.float32)


def eroded(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Without EDGE_BAND_PX at its edges, where pixels mix it with what is beside it: (H, W)."""
    inner: NDArray[np.bool_] = np.pad(mask, EDGE_BAND_PX, mode="edge")
    for axis in (0, 1):
        count = inner.shape[axis] - 2 * EDGE_BAND_PX
        inner = np.all([inner.take(range(k, k + count), axis) for k in range(2 * EDGE_BAND_PX + 1)], axis=0)
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


def harmonics(normals: FloatImage) -> FloatImage:
    """(N, 3) -> (N, 9): the spherical harmonics up to the second order, unscaled."""
    x, y, z = normals.T
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, x * z, x * x - y * y, 3 * z * z - 1], axis=1)
