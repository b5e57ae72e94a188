"""Colours of photos by the colour profile (ICC) or the numbers (CICP) in their files.

Photos have profiles of one kind: a curve for each of red, green and blue, then a matrix (ICC.1:2022, annex F.3). They
are computed here with all the bits of the photo, whose primaries stay. The numbers are those of ITU-T H.273.
"""

import re
import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from io import BytesIO
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import ImageCms

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.formats.images.hdr import HLG, PQ, hlg_display_light, hlg_scene_light, pq_light
from iibr_core.formats.images.picture import Picture
from iibr_core.formats.images.pillow_reader import DECODE_ERRORS
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import DISPLAY_P3, SRGB, ColorSpace, FloatImage

MAX_XYZ_DIFFERENCE = 2e-3
"""Largest difference between two programs' values of the same primaries, in XYZ."""
MIN_DETERMINANT = 1e-4
"""Smallest determinant of a matrix of primaries; below it they lie on a line."""
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""Cones from XYZ (ICC.1:2022, annex E.3)."""
D50 = np.array([0.9642, 1.0, 0.8249])
UNNAMED = "its own"
"""Name of a colour space that a file describes and does not name."""
D65_XY = (0.3127, 0.3290)
PRIMARIES = {
    1: ("sRGB", (0.640, 0.330, 0.300, 0.600, 0.150, 0.060, *D65_XY)),
    5: ("BT.601 (625 lines)", (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, *D65_XY)),
    6: ("BT.601 (525 lines)", (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *D65_XY)),
    9: ("BT.2020", (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *D65_XY)),
    11: ("DCI-P3", (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351)),
    12: ("Display P3", (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *D65_XY)),
}
"""Name, then x and y of red, green, blue and white, by their number (ITU-T H.273, table 2)."""
KNOTS = 65536
"""Number of values of a curve: one for each value of 16 bits."""
SAME_CURVE = 1 / 255
"""Largest difference of encoded values within one curve: a step of 8 bits, as small profiles of sRGB are off."""
UNNAMED_PROFILE = "without a name"
MAX_EXPONENT, MAX_FLOAT = 3.0, 1e6
"""Limits of the power law beyond white, and of the encoded values it is applied to."""
PARAMETRIC = (1, 3, 4, 5, 7)
"""Number of parameters of each kind of formula (ICC.1:2022, table 68)."""
MAX_PROFILE_BYTES = 4 * 2**20
"""Largest profile; those with a table for every colour, for printers, have one or two megabytes."""
Curve = Callable[[NDArray[Any]], NDArray[Any]]
Hdr = Literal["", "PQ", "HLG"]
CURVES_OF_CODES: dict[int, Curve] = {
    **dict.fromkeys((1, 6, 13, 14, 15), linear_from_srgb),
    4: lambda x: x**2.2,
    5: lambda x: x**2.8,
    8: lambda x: x,
    PQ: pq_light,
    HLG: hlg_scene_light,
}
"""Light of encoded values 0..1 by the number of the transfer curve (ITU-T H.273, table 3). Screens show the cameras'
curves (1, 6, 14, 15) as they show sRGB.
"""
HDR_CODES: dict[int, Hdr] = {PQ: "PQ", HLG: "HLG"}
PROFILE_FILES = {SRGB.name: "srgb.icc", DISPLAY_P3.name: "display-p3.icc"}
"""Profiles of the spaces that pictures are saved in, by the name of the space; both have sRGB's curve."""


@dataclass(frozen=True, eq=False)
class ColorProfile:
    """The meaning of a photo's numbers.

    curves: (3, KNOTS), linear light of red, green and blue, 1 = white; HLG's before it is displayed. color_space: its
    primaries. hdr: the curve of an HDR photo, whose light may exceed white; "" for other photos.
    """

    curves: FloatImage
    color_space: ColorSpace
    hdr: Hdr = ""

    def linear(self, pixels: NDArray[Any]) -> FloatImage:
        """Return linear light of `color_space`, float32, of pixels (H, W, 3), uint8, uint16 or float32."""
        light = _light_of_floats(self.curves, pixels) if pixels.dtype.kind == "f" else _look_up(self.curves, pixels)
        return hlg_display_light(light) if self.hdr == "HLG" else light

    def encoded(self, pixels: NDArray[Any]) -> FloatImage:
        """Return the same light encoded by sRGB's curve; not for HDR."""
        return _look_up(srgb_from_linear(self.curves), pixels)


@cache
def icc_profile(space: ColorSpace) -> bytes:
    """Return the colour profile (ICC.1:2022, version 4) of sRGB or Display P3, for saved pictures."""
    return (resource_folder("assets") / "profiles" / PROFILE_FILES[space.name]).read_bytes()


def _light_of_floats(curves: FloatImage, pixels: NDArray[Any]) -> FloatImage:
    """Return linear light of pixels (H, W, 3); beyond white, curves (3, KNOTS) go on as the power law they end with."""
    result, at = np.empty(pixels.shape, np.float32), np.linspace(0, 1, KNOTS, dtype=np.float32)
    for channel, curve in enumerate(curves):
        values, white = pixels[..., channel], float(curve[-1])
        exponent = min((1 - float(curve[-2]) / white) * (KNOTS - 1), MAX_EXPONENT) if white > 0 else 1.0
        beyond = white * np.clip(values, 1, MAX_FLOAT).astype(np.float64) ** exponent
        result[..., channel] = np.where(values > 1, beyond, np.interp(values, at, curve))
    return result


def _look_up(curves: FloatImage, pixels: NDArray[Any]) -> FloatImage:
    """Return the values of curves (3, KNOTS) at pixels (H, W, 3)."""
    steps = (KNOTS - 1) // np.iinfo(pixels.dtype).max  # 257 or 1
    result = np.empty(pixels.shape, np.float32)
    for channel, curve in enumerate(curves):
        result[..., channel] = np.ascontiguousarray(curve[::steps])[pixels[..., channel]]
    return result


def color_space_of(picture: Picture) -> ColorSpace:
    """Return the colour space of a picture: by its profile, or OpenEXR's chromaticities; sRGB where it states none."""
    if picture.is_float and not picture.icc:
        return space_of_chromaticities(picture.chromaticities)
    profile = color_profile_of(picture)[0]
    return SRGB if profile is None else profile.color_space


def color_profile_of(picture: Picture) -> tuple[ColorProfile | None, str]:
    """Return the profile of a picture, and a note about it; None, "" for sRGB, and for floats that are linear light.

    Numbers count more than a profile beside them (PNG, third edition, 11.3.2.6). A profile that cannot be used gives
    None and a note: the picture counts as sRGB. Grey has no primaries, so only its HDR curve matters.
    """
    if picture.is_float and not picture.icc:
        return None, ""
    name, complaint = _name_in(picture.icc), ""
    profile = profile_of_codes(picture.codes[:2] or codes_named(name))
    if profile is not None:
        name = profile.color_space.name
    elif picture.icc:
        profile, complaint = read_profile(picture.icc, picture.pixels.shape[2] < 3)
    if profile is not None and profile.hdr:
        return profile, f"HDR photo ({profile.hdr}): its highlights are compressed to the range of ordinary photos."
    if picture.is_float and profile is not None and (picture.pixels.shape[2] < 3 or _is_srgb(profile)):
        return profile, ""
    if picture.pixels.shape[2] < 3 or (profile is not None and _is_srgb(profile)):
        return None, ""
    if profile is None:
        note = f"The colour profile '{name}' {complaint} and is ignored: colours are taken as sRGB."
        return None, note if complaint and "sRGB" not in name else ""
    if profile.color_space.name == UNNAMED:
        profile = replace(profile, color_space=replace(profile.color_space, name=name))
    return profile, f"Colours are those of the photo's profile, '{name}'."


@lru_cache(maxsize=8)
def profile_of_codes(codes: tuple[int, ...]) -> ColorProfile | None:
    """Return the meaning of colours in numbers, primaries and transfer curve (ITU-T H.273); None for unknown ones."""
    if len(codes) != 2 or codes[1] not in CURVES_OF_CODES or (space := space_of_number(codes[0])) is None:
        return None
    curve = np.tile(CURVES_OF_CODES[codes[1]](np.linspace(0, 1, KNOTS)), (3, 1)).astype(np.float32)
    return ColorProfile(curve, space, HDR_CODES.get(codes[1], ""))


def codes_named(name: str) -> tuple[int, ...]:
    """Return the colours in numbers that a profile's name states, as HDR photos have them; () for other names.

    "ITUR_2100_PQ_FULL" is the name that W3C's note on BT.2100 in PNG gives to such a profile.
    """
    curve = re.search(r"(?<![^\W_])(PQ|HLG)(?![^\W_])", name)
    return () if curve is None else (12 if "P3" in name else 9, PQ if curve[0] == "PQ" else HLG)


@lru_cache(maxsize=8)  # the profiles are kept, too
def _is_srgb(profile: ColorProfile) -> bool:
    off = np.abs(srgb_from_linear(profile.curves) - np.linspace(0, 1, KNOTS, dtype=np.float32))
    return profile.color_space == SRGB and float(off.max()) < SAME_CURVE


@lru_cache(maxsize=4)  # a photo is read in many parts
def read_profile(data: bytes, is_grey: bool = False) -> tuple[ColorProfile | None, str]:
    """Return the meaning of a profile; where it cannot be used, None and the reason.

    is_grey: whether it belongs to a grey picture, whose profile may have one curve alone.
    """
    has_one_curve = is_grey and data[16:20] == b"GRAY"
    if data[16:24] != b"RGB XYZ " and not has_one_curve:
        return None, "is not for red, green and blue"
    if len(data) > MAX_PROFILE_BYTES:
        return None, "is too large"
    try:
        tags = _tags(data)
        if has_one_curve:
            curves = np.tile(_curve(tags[b"kTRC"]), (3, 1))
            return ColorProfile(np.clip(curves, 0, 1).astype(np.float32), SRGB), ""
        if (coded := profile_of_codes(tuple(tags.get(b"cicp", b"")[8:10]))) is not None and coded.hdr:
            return coded, ""
        colors = [struct.unpack_from(">3i", tags[name], 8) for name in (b"rXYZ", b"gXYZ", b"bXYZ")]
        curves = np.stack([_curve(tags[name]) for name in (b"rTRC", b"gTRC", b"bTRC")])
    except KeyError:
        return None, "has no curves with a matrix"
    except (struct.error, IndexError):
        return None, "is damaged"
    matrix = np.array(colors).T / 65536
    if not (np.isfinite(curves).all() and abs(np.linalg.det(matrix)) > MIN_DETERMINANT):
        return None, "is damaged"
    return ColorProfile(np.clip(curves, 0, 1).astype(np.float32), space_of_matrix(matrix)), ""


def _tags(data: bytes) -> dict[bytes, bytes]:
    """Return the tags of a profile by signature (clause 7.3)."""
    (count,) = struct.unpack_from(">I", data, 128)
    entries = (struct.unpack_from(">4sII", data, 132 + 12 * k) for k in range(min(count, 100)))
    return {name: data[start : start + size] for name, start, size in entries}


@lru_cache(maxsize=4)
def _name_in(data: bytes) -> str:
    """Return the description of a profile."""
    with suppress(ImageCms.PyCMSError, *DECODE_ERRORS):
        return ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(BytesIO(data))).strip() or UNNAMED_PROFILE
    return UNNAMED_PROFILE


def _curve(tag: bytes) -> NDArray[np.float64]:
    """Return linear light (KNOTS,) of evenly spaced values, from a table (clause 10.6) or a formula (10.18)."""
    x = np.linspace(0, 1, KNOTS)
    (count,) = struct.unpack_from(">I", tag, 8)
    if tag[:4] == b"para":
        kind = count >> 16
        return _formula(kind, x, np.array(struct.unpack_from(f">{PARAMETRIC[kind]}i", tag, 12)) / 65536)
    if tag[:4] != b"curv":
        raise KeyError(tag[:4])
    if count == 0:
        return x
    table = np.array(struct.unpack_from(f">{count}H", tag, 12))
    return x ** float(table[0] / 256) if count == 1 else np.interp(x, np.linspace(0, 1, count), table / 65535)


def _formula(kind: int, x: NDArray[np.float64], parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (a x + b)^g + e where x >= d, else c x + f."""
    defaults = (1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    g, a, b, c, d, e, f = (*map(float, parameters), *defaults[len(parameters) :])
    if kind in (1, 2):
        # The third parameter of these kinds is added to both parts; the power begins where its base is 0.
        e = f = c if kind == 2 else 0.0
        c, d = 0.0, -b / a if a else 0.0
    with np.errstate(all="ignore"):
        power = np.maximum(a * x + b, 0) ** g + e
    return np.asarray(np.where(x >= d, power, c * x + f))


@cache
def space_of_number(number: int) -> ColorSpace | None:
    """Return the colour space of a number of ITU-T H.273; None where that has no such primaries."""
    if number not in PRIMARIES:
        return None
    name, xy = PRIMARIES[number]
    return space_of_chromaticities(xy, name)


def space_of_chromaticities(xy: Any, name: str = UNNAMED) -> ColorSpace:
    """Return the colour space of these primaries, adapted to D50 (Bradford).

    xy: x and y of red, green, blue and white, 8 numbers; what cannot be primaries gives sRGB. name: of the space, where
    it is neither sRGB nor Display P3.
    """
    if not isinstance(xy, tuple) or len(xy) != 8:
        return SRGB
    points = np.array(xy, np.float64).reshape(4, 2)
    if not (np.abs(points).max() < 10 and points[:, 1].all()):
        return SRGB
    x, y = points.T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    cones = BRADFORD @ np.stack([D50, xyz[:, 3]], axis=1)
    if abs(np.linalg.det(xyz[:, :3])) < MIN_DETERMINANT or not (cones > 0).all():
        return SRGB
    adapted = np.linalg.solve(BRADFORD, (cones[:, :1] / cones[:, 1:]) * BRADFORD)
    return space_of_matrix(adapted @ (xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])), name)


def space_of_matrix(matrix: NDArray[np.float64], name: str = UNNAMED) -> ColorSpace:
    """Return the colour space of a matrix (3, 3) to XYZ under D50: sRGB or Display P3 where it hardly differs."""
    for known in (SRGB, DISPLAY_P3):
        if np.abs(matrix - np.array(known.xyz_from_linear)).max() < MAX_XYZ_DIFFERENCE:
            return known
    red, green, blue = ((float(x), float(y), float(z)) for x, y, z in matrix)
    return ColorSpace(name, (red, green, blue))
