"""Calibrations of lenticular displays (Looking Glass): how the lenses of a display lie over its subpixels.

The text is that of the display's file `visual.json`, which Bridge reports, too. Conventions are those of the maker's
shaders: x to the right, y upwards, views from the left to the right.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iibr_core.formats.files import parsing, printable, read_text
from iibr_core.formats.quilts import SCREENS, Quilt, quilt_for
from iibr_core.types import ImageSize, InputError

NUMBERS: dict[str, tuple[float, float, float | None]] = {
    "pitch": (1.0, 1000.0, None), "slope": (-1000.0, 1000.0, None), "center": (-1000.0, 1000.0, None),
    "DPI": (10.0, 5000.0, None), "screenW": (16.0, 8192.0, None), "screenH": (16.0, 8192.0, None),
    "invView": (0.0, 1.0, 1.0), "flipImageX": (0.0, 1.0, 0.0), "flipImageY": (0.0, 1.0, 0.0),
    "flipSubp": (0.0, 1.0, 0.0), "CellPatternMode": (0.0, 4.0, 0.0),
}  # fmt: skip
"""Least and largest value of each number, and its default, None if it must be stated. Lenses are counted per inch."""
MIN_SLOPE = 0.1
MAX_CELLS = 16
MAX_OFFSET_PX = 4.0
STRIPES = ((0.0, 0.0), (1 / 3, 0.0), (2 / 3, 0.0))
"""Offsets of red, green and blue where they stand side by side, in pixels."""

Offsets = tuple[tuple[float, float], ...]
"""Offsets (x, y) of red, green and blue in pixels."""


@dataclass(frozen=True)
class Calibration:
    """Lenses and subpixels of a display.

    screen: its size in pixels. lenses_per_px: number of lenses (x, y) that a step of one pixel crosses, as the picture
    is seen. center: part of a lens by which the first one is shifted. is_inverted: whether views are counted against
    the direction in which x crosses a lens, as on all displays known. is_mirrored: whether the picture is seen mirrored
    (x, y). cells: offsets of the subpixels, a kind of pixel each. pattern: order of the cells, see `cell_of` in
    shaders/lenticular.frag.
    """

    screen: ImageSize
    lenses_per_px: tuple[float, float]
    center: float
    is_inverted: bool
    is_mirrored: tuple[bool, bool]
    cells: tuple[Offsets, ...]
    pattern: int

    @property
    def quilt(self) -> Quilt:
        """Recommended quilt of this display."""
        return quilt_for(SCREENS.get(self.screen), self.screen)


def read_calibration(path: Path) -> Calibration:
    """Read a display's calibration. Raises InputError."""
    return parse_calibration(read_text(path), str(path))


def parse_calibration(text: str, origin: str) -> Calibration:
    """Return the calibration that a JSON text states. origin: its place, for messages. Raises InputError."""
    with parsing(origin, f"is no calibration ({{}}); {GET_AGAIN}"):
        stated = json.loads(text)
    if not isinstance(stated, dict):
        raise InputError(f"{origin}: is no calibration, which states a pitch, a slope and a center; {GET_AGAIN}")
    values = {key.lower(): _unwrapped(value) for key, value in stated.items()}
    number = {key: _number(values.get(key.lower()), key, limits, origin) for key, limits in NUMBERS.items()}
    slope, is_mirrored = number["slope"], (number["flipImageX"] > 0.5, number["flipImageY"] > 0.5)
    if abs(slope) < MIN_SLOPE:
        raise InputError(f"{origin}: slope is {slope:g}, so the lenses lie along the rows; {GET_AGAIN}")
    across = number["pitch"] / number["DPI"] * math.cos(math.atan(1 / slope))
    cells = _cells(values.get("subpixelcells"), origin) or (STRIPES,)
    return Calibration(
        ImageSize(int(number["screenH"]), int(number["screenW"])),
        (across, across / slope * (-1 if is_mirrored[0] else 1)),
        number["center"],
        number["invView"] > 0.5,
        is_mirrored,
        tuple(cell[::-1] for cell in cells) if number["flipSubp"] > 0.5 else cells,
        int(number["CellPatternMode"]),
    )


GET_AGAIN = "get the file visual.json of the display, or the calibration that Bridge reports"


def _unwrapped(value: Any) -> Any:
    return value.get("value") if isinstance(value, dict) else value


def _number(value: Any, key: str, limits: tuple[float, float, float | None], origin: str) -> float:
    """Return a number within its limits, or its default."""
    low, high, default = limits
    if value is None and default is not None:
        return default
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):
        found = "missing" if value is None else printable(str(value))
        raise InputError(f"{origin}: {key} is {found}, not a number from {low:g} to {high:g}; {GET_AGAIN}")
    return float(value)


def _cells(stated: Any, origin: str) -> tuple[Offsets, ...]:
    """Return the offsets of subpixels that are not stripes."""
    if stated is None:
        return ()
    if not isinstance(stated, list) or len(stated) > MAX_CELLS or not all(isinstance(cell, dict) for cell in stated):
        raise InputError(f"{origin}: subpixelCells is no list of at most {MAX_CELLS} cells; {GET_AGAIN}")

    def offset(cell: dict[str, Any], key: str) -> float:
        return _number(cell.get(key), key, (-MAX_OFFSET_PX, MAX_OFFSET_PX, None), origin)

    return tuple(tuple((offset(cell, f"{c}OffsetX"), offset(cell, f"{c}OffsetY")) for c in "RGB") for cell in stated)
