"""From where the light comes whose highlight a photo shows: a highlight's place and the surface's normals tell."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.gloss.gloss_settings import Gloss, Triple
from iibr_core.rendering.gloss.microfacet import lobe_shares
from iibr_core.rendering.gloss.separation import CLIPPED, eroded, harmonics
from iibr_core.runtime.work import Cancelled, is_stopped
from iibr_core.types import FloatImage

MOST_HIGHLIGHT_PIXELS = 4000
MOST_CANDIDATES = 400
FIRST_STEP, LAST_STEP = 0.15, 0.002
"""Of the climb from the best candidate, radians."""
LEAST_EXPLAINED = 0.45
"""Of what the matt part leaves. On 48 made-up surfaces with paint of all kinds and no highlight, no light explained
more than 0.40; on 36 with paint that is no mere grey and a highlight, its light explained 0.56 and more.
"""
LEAST_HIGHLIGHT = 0.02
"""Of white, linear, at its brightest: what is weaker is no highlight."""
LEAST_OWN = 1e-3
"""Of a lobe that the matt part cannot explain, else it tells nothing."""

Score = Callable[[FloatImage], float]


def find_light(
    gloss: Gloss,
    linear: FloatImage,
    points: FloatImage,
    normals: FloatImage,
    mask: FloatImage,
) -> Triple | None:
    """Towards the light, of length 1, that the gloss reflects in a photo; None where none is clearly seen.

    linear: (H, W, 3). points: (H, W, 3) from the eye; normals: (H, W, 3); mask: (H, W), 0..1. For a light from anywhere
    the best share of matt part and lobe is known at once (linear least squares): lights are tried that pixels mirror to
    the eye, then it is climbed from the best. The light is white, so that differences between channels are paint's.

    """
    inside = np.flatnonzero(eroded(mask > 0.5))
    colors, facing = linear.reshape(-1, 3), normals.reshape(-1, 3)
    fitted = inside[colors[inside].max(axis=1) < CLIPPED]
    fitted = fitted[:: max(-(-len(fitted) // MOST_HIGHLIGHT_PIXELS), 1)]
    if not len(fitted):
        return None
    basis = _matt_basis(colors[fitted], facing[fitted])
    if len(fitted) <= 2 * basis.shape[1]:
        return None
    to_eye = _to_eye(points, fitted)
    grey = colors[fitted].mean(axis=1, dtype=np.float64)
    rest = grey - basis @ (basis.T @ grey)
    width2, disc = gloss.lobe_widths

    def explained(light: FloatImage) -> float:
        """The share of what the matt part leaves that a light explains."""
        if is_stopped():
            raise Cancelled
        lobe = lobe_shares(facing[fitted], to_eye, light, width2, disc, gloss.reflectance)
        own = lobe - basis @ (basis.T @ lobe)
        energy = own @ own
        if not energy > LEAST_OWN * (lobe @ lobe):
            return 0.0
        strength = max(own @ rest, 0.0) / energy
        is_seen = strength * lobe.max() > LEAST_HIGHLIGHT
        return float(strength**2 * energy / (rest @ rest)) if is_seen else 0.0

    tried = _spread(inside, colors)
    light, share = _climbed(explained, _mirrored(facing[tried], _to_eye(points, tried)))
    if share < LEAST_EXPLAINED:
        return None
    x, y, z = map(float, light)
    return x, y, z


def _matt_basis(colors: FloatImage, normals: FloatImage) -> NDArray[np.float64]:
    """Orthonormal (N, K): what the grey of a matt surface (N, 3) is made of. Shading is a quadratic form of the normal;
    paints of several colours differ by chromaticity, which a white light leaves as it is.
    """
    chroma = np.diff(colors, axis=1)
    shaded = [chroma * normals[:, axis : axis + 1] for axis in range(3)]
    terms = np.concatenate([harmonics(normals), chroma, *shaded], axis=1).astype(np.float64)
    terms /= np.maximum(np.abs(terms).max(axis=0), 1e-9)
    across, sizes, _ = np.linalg.svd(terms, full_matrices=False)
    return np.asarray(across[:, sizes > 1e-3 * sizes[0]])


def _to_eye(points: FloatImage, chosen: NDArray[np.intp]) -> FloatImage:
    """(N, 3), of length 1."""
    away = points.reshape(-1, 3)[chosen]
    return np.asarray(-away / np.linalg.norm(away, axis=1, keepdims=True))


def _mirrored(normals: FloatImage, to_eye: FloatImage) -> FloatImage:
    """Towards the lights (N, 3) that such surfaces mirror to the eye."""
    return np.asarray(2 * (normals * to_eye).sum(axis=1, keepdims=True) * normals - to_eye)


def _spread(inside: NDArray[np.intp], colors: FloatImage) -> NDArray[np.intp]:
    """Pixels to try: half of them anywhere, half the brightest in every channel."""
    anywhere = inside[:: max(-(-len(inside) // (MOST_CANDIDATES // 2)), 1)]
    order = np.argsort(-colors[inside].min(axis=1), kind="stable")
    return np.concatenate([anywhere, inside[order[: MOST_CANDIDATES // 2]]])


def _climbed(score: Score, lights: FloatImage) -> tuple[FloatImage, float]:
    """The best light and its score, from the best of these (N, 3) uphill in ever smaller steps."""
    scores = [score(light) for light in lights]
    best = int(np.argmax(scores))
    light, height, step = lights[best], scores[best], FIRST_STEP
    while step > LAST_STEP and height > 0:
        across, down = np.linalg.svd(light[None])[2][1:]
        around = [light + step * (a * across + b * down) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b]
        around = [np.asarray(other / np.linalg.norm(other), np.float32) for other in around]
        heights = [score(other) for other in around]
        if max(heights) > height:
            height, light = max(heights), around[int(np.argmax(heights))]
        else:
            step /= 2
    return light, height
