"""What a photo's numbers mean where its embedded colour profile (ICC) says that they are not sRGB.

Photos carry profiles of one kind: a curve for each of red, green and blue, then a matrix (ICC.1:2022, annex F.3). They
are computed here with all the bits that the photo has. The primaries stay the photo's own, so no colour is lost.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import srgb_from_linear
from iibr_core.formats.images.icc_profile import icc_profile
from iibr_core.formats.images.oiio_reader import FLOATING_TYPES, text_attribute
from iibr_core.types import DISPLAY_P3, SRGB, ColorSpace, FloatImage

KNOTS = 65536
"""Of a curve: one for each value of 16 bits."""
SAME_PRIMARIES = 2e-3
"""Of XYZ: as much as the programs that write profiles differ about sRGB's and Display P3's."""
SAME_CURVE = 1 / 255
"""Of encoded values: a step of 8 bits, as much as sRGB's own curve is off in small profiles."""
LEAST_DETERMINANT = 1e-4
"""Of the matrix: primaries on one line are none."""
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""Cones from XYZ (ICC.1:2022, annex E.3)."""
D50 = np.array([0.9642, 1.0, 0.8249])
P3_CODES = 12, 13
"""Display P3's primaries and sRGB's curve, by the numbers of ITU-T H.273."""
PARAMETRIC = {0: 1, 1: 3, 2: 4, 3: 5, 4: 7}
"""Parameters of each kind of formula (ICC.1:2022, table 68)."""
MOST_PROFILE_BYTES = 4 * 2**20
"""Those with a table for every colour, for printers, take one or two megabytes."""


@dataclass(frozen=True, eq=False)
class ColorProfile:
    """curves: (3, KNOTS), linear light of red, green and blue. color_space: what these are."""

    curves: FloatImage
    color_space: ColorSpace

    def linear(self, pixels: NDArray[Any]) -> FloatImage:
        """Linear light of `color_space`, 0..1, float32, of pixels (H, W, 3), uint8 or uint16."""
        return _look_up(self.curves, pixels)

    def encoded(self, pixels: NDArray[Any]) -> FloatImage:
        """The same, encoded by sRGB's curve."""
        return _look_up(srgb_from_linear(self.curves), pixels)


class UnusableProfileError(ValueError):
    """Damaged, or not of the kind that photos have; the message says which."""


def _look_up(curves: FloatImage, pixels: NDArray[Any]) -> FloatImage:
    """(H, W, 3) of curves (3, KNOTS) at pixels (H, W, 3)."""
    steps = (KNOTS - 1) // np.iinfo(pixels.dtype).max  # 257 or 1
    result = np.empty(pixels.shape, np.float32)
    for channel, curve in enumerate(curves):
        result[..., channel] = np.ascontiguousarray(curve[::steps])[pixels[..., channel]]
    return result


def color_space_of(spec: Any) -> ColorSpace:
    """Of a picture's numbers: by its profile, or what OpenEXR has in its place; sRGB where it says nothing."""
    if str(spec.format) in FLOATING_TYPES:
        return _space_of_chromaticities(spec.getattribute("chromaticities"))
    profile = color_profile_of(spec)[0]
    return SRGB if profile is None else profile.color_space


def color_profile_of(spec: Any) -> tuple[ColorProfile | None, str]:
    """The profile in the header of a picture of whole numbers, and a note about it; None, "" without one, or for sRGB.

    None and a note where it cannot be used: the picture counts as sRGB then. Grey has no primaries.
    """
    if str(spec.format) in FLOATING_TYPES or spec.nchannels < 3:
        return None, ""
    value, codes = spec.getattribute("ICCProfile"), spec.getattribute("CICP")
    name = text_attribute(spec, "ICCProfile:profile_description") or "without a name"
    # They count more than a profile beside them (PNG, third edition, 11.3.2.6).
    if isinstance(codes, tuple) and codes[:2] == P3_CODES:
        value, name = np.frombuffer(icc_profile(DISPLAY_P3), np.uint8), DISPLAY_P3.name
    if value is None:
        return None, ""
    profile, complaint = _read(bytes(value) if isinstance(value, np.ndarray) else b"")
    if profile is None:
        is_told = complaint and "sRGB" not in name
        told = f"The colour profile '{name}' {complaint} and is ignored: colours are taken as sRGB."
        return None, told if is_told else ""
    if profile.color_space.name not in (SRGB.name, DISPLAY_P3.name):
        profile = replace(profile, color_space=replace(profile.color_space, name=name))
    return profile, f"Colours are those of the photo's profile, '{name}'."


@lru_cache(maxsize=4)  # a photo is read in many parts
def _read(data: bytes) -> tuple[ColorProfile | None, str]:
    """None, "" for sRGB: by what is in it, as some that are linear have that in their names."""
    try:
        profile = color_profile(data)
        return (None if _is_srgb(profile) else profile), ""
    except UnusableProfileError as error:
        return None, str(error)


def _is_srgb(profile: ColorProfile) -> bool:
    off = np.abs(srgb_from_linear(profile.curves) - np.linspace(0, 1, KNOTS, dtype=np.float32))
    return profile.color_space == SRGB and float(off.max()) < SAME_CURVE


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
    return ColorProfile(np.clip(curves, 0, 1).astype(np.float32), _color_space(matrix))


def _color_space(matrix: NDArray[np.float64]) -> ColorSpace:
    """The space of these primaries; one that is known where they hardly differ."""
    for known in (SRGB, DISPLAY_P3):
        if np.abs(matrix - np.array(known.xyz_from_linear)).max() < SAME_PRIMARIES:
            return known
    red, green, blue = (tuple(map(float, row)) for row in matrix)
    return ColorSpace("its own", (red, green, blue))  # type: ignore[arg-type]  # three numbers each


def _space_of_chromaticities(value: Any) -> ColorSpace:
    """Of red's, green's, blue's and white's x and y (OpenEXR's `chromaticities`), seen under D50 (Bradford); sRGB where
    they mean nothing.
    """
    if not isinstance(value, tuple) or len(value) != 8:
        return SRGB
    xy = np.array(value, np.float64).reshape(4, 2)
    if not (np.isfinite(xy).all() and np.abs(xy).max() < 10 and np.abs(xy[:, 1]).min() > 0):
        return SRGB
    xyz = np.stack([xy[:, 0] / xy[:, 1], np.ones(4), (1 - xy.sum(axis=1)) / xy[:, 1]])
    if abs(np.linalg.det(xyz[:, :3])) < LEAST_DETERMINANT:
        return SRGB
    cones = BRADFORD @ np.stack([D50, xyz[:, 3]], axis=1)
    if not (cones > 0).all():
        return SRGB
    adapted = np.linalg.solve(BRADFORD, (cones[:, :1] / cones[:, 1:]) * BRADFORD)
    return _color_space(adapted @ (xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])))


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
