"""HDR photos: light of the curves PQ and HLG (ITU-R BT.2100), and its compression to the range of ordinary photos.

Light is relative to the white of ordinary photos, which HDR pictures show at 203 cd/m2 (ITU-R BT.2408).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.types import FloatImage

PQ, HLG = 16, 18
"""Numbers of the curves (ITU-T H.273, table 3)."""
WHITE_CD_M2 = 203.0
PQ_PEAK_CD_M2 = 10_000.0
HLG_PEAK_CD_M2 = 1_000.0
"""Brightness of the display that HLG's system gamma is meant for."""
HLG_GAMMA = 1.2
BT2020_LUMINANCE = (0.2627, 0.6780, 0.0593)
KNEE = 0.6
"""Light below which nothing is changed, as a share of white: 80 % of it as sRGB encodes it."""


def pq_light(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """Return the light of PQ values 0..1: up to 49 times white (BT.2100, table 4)."""
    m1, m2, c1, c2, c3 = 2610 / 16384, 2523 / 32, 3424 / 4096, 2413 / 128, 2392 / 128
    power = np.asarray(encoded, np.float64) ** (1 / m2)
    share = (np.maximum(power - c1, 0) / (c2 - c3 * power)) ** (1 / m1)
    return np.asarray(share * (PQ_PEAK_CD_M2 / WHITE_CD_M2))


def hlg_scene_light(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """Return the light of HLG values 0..1 in front of the camera, 0..1 (BT.2100, table 5)."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    x = np.asarray(encoded, np.float64)
    return np.asarray(np.where(x <= 0.5, x**2 / 3, (np.exp((x - c) / a) + b) / 12))


def hlg_display_light(scene: FloatImage) -> FloatImage:
    """Return the light that a display shows of HLG's light in front of the camera, (H, W, 3), relative to white."""
    luminance = scene @ np.array(BT2020_LUMINANCE, np.float32)
    gain = np.maximum(luminance, 0) ** np.float32(HLG_GAMMA - 1) * np.float32(HLG_PEAK_CD_M2 / WHITE_CD_M2)
    light: FloatImage = scene * gain[..., None]
    return light


def tone_map(light: FloatImage) -> None:
    """Compress light (H, W, 3) to 0..1 in place; light up to `KNEE` does not change, nor does a picture up to white.

    The largest channel of each pixel follows Reinhard's extended curve from the knee on, so that the brightest pixel
    of the picture becomes white; the other channels keep their ratio to it ("Photographic tone reproduction", 2002).
    """
    peak = float(light.max(initial=0.0))
    if peak <= 1:
        return
    white = (peak - KNEE) / (1 - KNEE)
    for first in range(0, len(light), ROWS_AT_ONCE):
        rows = light[first : first + ROWS_AT_ONCE]
        largest = rows.max(axis=2)
        x = np.maximum(largest - KNEE, 0) / (1 - KNEE)
        mapped = KNEE + (1 - KNEE) * x * (1 + x / white**2) / (1 + x)
        rows *= np.where(x > 0, mapped / np.maximum(largest, KNEE), 1)[..., None]
    np.clip(light, 0, 1, out=light)
