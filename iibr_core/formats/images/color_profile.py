"""What a photo's numbers mean where its embedded colour profile (ICC) says that they are not sRGB.

Photos carry profiles of one kind: a curve for each of red, green and blue, then a matrix (ICC.1:2022, annex F.3). They
are computed here with all the bits that the photo has; colours that sRGB does not hold are moved to its edge.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.images.oiio_reader import text_attribute
from iibr_core.types import FloatImage

ROWS_AT_ONCE = 64
"""Of a photo: what comes between takes twice its memory."""
KNOTS = 65536
"""Of a curve: one for each value of 16 bits."""
SRGB_D50 = np.array(
    [
        [0.4360747, 0.3850649, 0.1430804],
        [0.2225045, 0.7168786, 0.0606169],
        [0.0139322, 0.0971045, 0.7141733],
    ]
)
"""XYZ under profiles' white (D50, Bradford) of linear sRGB: IEC 61966-2-1 with ICC.1:2022, annex E."""
LEAST_DETERMINANT = 1e-4
"""Of the matrix: primaries on one line are none."""
PARAMETRIC = {0: 1, 1: 3, 2: 4, 3: 5, 4: 7}
"""Parameters of each kind of formula (ICC.1:2022, table 68)."""
MOST_PROFILE_BYTES = 4 * 2**20
"""Those with a table for every colour, for printers, take one or two megabytes."""


@dataclass(frozen=True, eq=False)
class ColorProfile:
    """curves: (3, KNOTS), linear light of red, green and blue. matrix: (3, 3), linear sRGB from that."""

    curves: FloatImage
    matrix: FloatImage

    def linear_srgb(self, pixels: NDArray[Any]) -> FloatImage:
        """Linear light within sRGB, float32, of pixels (H, W, 3), uint8 or uint16."""
        steps = (KNOTS - 1) // np.iinfo(pixels.dtype).max  # 257 or 1
        curves = np.ascontiguousarray(self.curves[:, ::steps])
        result = np.empty(pixels.shape, np.float32)
        for first in range(0, len(pixels), ROWS_AT_ONCE):
            rows = slice(first, first + ROWS_AT_ONCE)
            light = np.stack([curves[channel][pixels[rows, :, channel]] for channel in range(3)], axis=-1)
            np.clip(light @ self.matrix.T, 0, 1, out=result[rows])
        return result


class UnusableProfileError(ValueError):
    """Damaged, or not of the kind that photos have; the message says which."""


def color_profile_of(spec: Any) -> tuple[ColorProfile | None, str]:
    """The profile in a picture's header, and a note about it; None, "" without one, or for sRGB.

    None and a note where it cannot be used: the picture counts as sRGB then.
    """
    value = spec.getattribute("ICCProfile")
    name = text_attribute(spec, "ICCProfile:profile_description") or "without a name"
    if value is None or "sRGB" in name:
        return None, ""
    profile, complaint = _read(bytes(value) if isinstance(value, np.ndarray) else b"")
    if profile is None:
        return None, f"The colour profile '{name}' {complaint} and is ignored: colours are taken as sRGB."
    return profile, f"Colours were converted to sRGB by the photo's profile, '{name}'."


@lru_cache(maxsize=4)  # a photo is read in many parts
def _read(data: bytes) -> tuple[ColorProfile | None, str]:
    try:
        return color_profile(data), ""
    except UnusableProfileError as error:
        return None, str(error)


def color_profile(data: bytes) -> ColorProfile:
    """Read a profile. Raises UnusableProfileError."""
    try:
        if data[16:24] != b"RGB XYZ ":
            raise UnusableProfileError("is not for red, green and blue")
        tags = _tags(data)
        matrix = np.stack([_xyz(tags[name]) for name in (b"rXYZ", b"gXYZ", b"bXYZ")], axis=1)
        curves = np.stack([_curve(tags[name]) for name in (b"rTRC", b"gTRC", b"bTRC")])
    except KeyError as error:
        raise UnusableProfileError("has no curves with a matrix") from error
    except (struct.error, IndexError) as error:
        raise UnusableProfileError("is damaged") from error
    if not (np.isfinite(curves).all() and abs(np.linalg.det(matrix)) > LEAST_DETERMINANT):
        raise UnusableProfileError("is damaged")
    return ColorProfile(np.clip(curves, 0, 1).astype(np.float32), np.linalg.solve(SRGB_D50, matrix).astype(np.float32))


def _tags(data: bytes) -> dict[bytes, bytes]:
    """What a profile holds, by signature (clause 7.3)."""
    if len(data) > MOST_PROFILE_BYTES:
        raise UnusableProfileError("is too large")
    (count,) = struct.unpack_from(">I", data, 128)
    entries = (struct.unpack_from(">4sII", data, 132 + 12 * k) for k in range(min(count, 100)))
    return {name: data[start : start + size] for name, start, size in entries}


def _xyz(tag: bytes) -> NDArray[np.float64]:
    return np.array(struct.unpack_from(">3i", tag, 8)) / 65536


def _curve(tag: bytes) -> NDArray[np.float64]:
    """(KNOTS,) linear light of evenly spaced values; of a table (clause 10.6) or a formula (10.18)."""
    x = np.linspace(0, 1, KNOTS)
    (count,) = struct.unpack_from(">I", tag, 8)
    if tag[:4] == b"para":
        kind = count >> 16
        if kind not in PARAMETRIC:
            raise UnusableProfileError("is damaged")
        return _formula(kind, x, np.array(struct.unpack_from(f">{PARAMETRIC[kind]}i", tag, 12)) / 65536)
    if tag[:4] != b"curv":
        raise UnusableProfileError("has no curves with a matrix")
    if count == 0:
        return x
    if count > KNOTS:
        raise UnusableProfileError("is damaged")
    table = np.array(struct.unpack_from(f">{count}H", tag, 12))
    if count == 1:
        return x ** float(table[0] / 256)
    return np.interp(x, np.linspace(0, 1, count), table / 65535)


def _formula(kind: int, x: NDArray[np.float64], parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """(a x + b)^g + e where x >= d, else c x + f."""
    usual = (1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    g, a, b, c, d, e, f = (*map(float, parameters), *usual[len(parameters) :])
    if kind in (1, 2):
        # Here the third one is a constant added to both parts, and the power begins where its base is 0.
        e = f = c
        c, d = 0.0, -b / a if a else 0.0
        if kind == 1:
            e = f = 0.0
    with np.errstate(all="ignore"):
        power = np.maximum(a * x + b, 0) ** g + e
    return np.asarray(np.where(x >= d, power, c * x + f))
