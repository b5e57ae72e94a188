"""Anaglyphs for red-cyan glasses.

Dubois, "A projection method to generate anaglyph stereo images", ICASSP 2001, with the matrices of 2009 for sRGB.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, linear_from_srgb, srgb_from_linear
from iibr_core.types import FloatImage

# Rows are red, green and blue of the display.
LEFT = np.array([[0.437, 0.449, 0.164], [-0.062, -0.062, -0.024], [-0.048, -0.050, -0.017]], np.float32)
RIGHT = np.array([[-0.011, -0.032, -0.007], [0.377, 0.761, 0.009], [-0.026, -0.093, 1.234]], np.float32)


def anaglyph(left: NDArray[Any], right: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the anaglyph (H, W, 3) of two sRGB-encoded pictures (H, W, 3) uint8, by least squares in linear light.

    Each eye's light is clipped to the range of the display before the two are added.
    """
    return bytes_from_encoded(srgb_from_linear(_seen(left, LEFT) + _seen(right, RIGHT)))


def _seen(eye: NDArray[Any], matrix: FloatImage) -> FloatImage:
    light: FloatImage = np.clip(linear_from_srgb(eye / np.float32(255)) @ matrix.T, 0, 1)
    return light
