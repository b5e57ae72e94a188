"""Gaussian splats as SPZ, Niantic's compressed format: about a tenth of a PLY file's size.

A gzip stream holds a header, then each property of all splats: fixed-point places of 24 bits, the rest in bytes.
"""

import gzip
import math
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage

HEADER = "<4sIIBBBB"
"""Layout of the header: magic, version, number of splats, degree of harmonics, fractional bits, flags, zero."""
VERSION = 2
"""The version that every reader knows; later ones differ in rotations, which round splats do not have."""
MAX_FIXED = 2**23 - 1
MAX_FRACTIONAL_BITS = 23
MIN_LOG_RADIUS = -10.0
"""Natural logarithm of the smallest radius."""
STEPS_PER_LOG = 16
COLOR_SCALE = 0.15 / 0.28209479177387814
"""Contrast of stored colours: they leave room above white and below black."""
NO_ROTATION = 128


def write_spz(path: Path, places: FloatImage, radii: FloatImage, colors: NDArray[np.uint8], opacity: float) -> float:
    """Write round splats, y up and z backwards; return the factor that their lengths are stored with.

    It is 1, or the power of ten that makes the smallest radius one that the format can express. places, colors: (N, 3).
    radii: (N,), standard deviations, positive. opacity: 0 to 1.
    """
    smallest = math.log(float(radii.min()))
    factor = 10.0 ** max(math.ceil((MIN_LOG_RADIUS - smallest) / math.log(10)), 0)
    farthest = float(np.abs(places).max()) * factor
    bits = min(max(math.floor(math.log2(MAX_FIXED / farthest)), 0), MAX_FRACTIONAL_BITS)
    fixed = np.clip(np.rint(places * (factor * 2**bits)), -MAX_FIXED, MAX_FIXED).astype("<i4")
    parts = [
        fixed[..., None].view(np.uint8)[..., :3],
        np.full(len(places), round(255 * opacity)),
        np.rint((colors / 255 - 0.5) * (COLOR_SCALE * 255) + 127.5),
        np.repeat(np.rint((np.log(radii * factor) - MIN_LOG_RADIUS) * STEPS_PER_LOG)[:, None], 3, axis=1),
        np.full((len(places), 3), NO_ROTATION),
    ]
    content = b"".join(np.clip(part, 0, 255).astype(np.uint8).tobytes() for part in parts)
    header = struct.pack(HEADER, b"NGSP", VERSION, len(places), 0, bits, 0, 0)
    with write_file(path) as temporary:
        temporary.write_bytes(gzip.compress(header + content, 6, mtime=0))
    return factor
