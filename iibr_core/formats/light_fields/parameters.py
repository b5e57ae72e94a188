"""`parameters.cfg`, in which the HCI 4D Light Field Benchmark (Honauer et al., ACCV 2016) describes a light field."""

from __future__ import annotations

import configparser
import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from iibr_core.formats.files import is_file, read_text, reason_of
from iibr_core.types import GridShape, ImageSize, InputError

FILE_NAME = "parameters.cfg"


def read_parameters(folder: Path) -> dict[str, float]:
    """Return every finite number of the folder's parameters by name, whatever its section; empty without a file.

    Raises InputError for a file that is too large or no text with sections.
    """
    path = folder / FILE_NAME
    if not is_file(path) or path.stat().st_size == 0:
        return {}
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string(read_text(path))
    except configparser.Error as error:
        raise InputError(f"{path}: is not a valid parameter file ({reason_of(error)}); correct or remove it") from error
    numbers: dict[str, float] = {}
    for section in parser.sections():
        for name, text in parser.items(section):
            with suppress(ValueError):
                if math.isfinite(number := float(text)):
                    numbers[name] = number
    return numbers


def stated_grid(parameters: Mapping[str, float]) -> GridShape | None:
    """Return the numbers of cameras, which need not make sense; None if neither is stated."""
    rows, columns = int(parameters.get("num_cams_y", 0)), int(parameters.get("num_cams_x", 0))
    return GridShape(rows, columns) if rows or columns else None


def stated_focal_px(parameters: Mapping[str, float], size: ImageSize) -> float | None:
    """Return the focal length in pixels of a view of this size; None if it is not stated or makes no sense."""
    focal_mm, sensor_mm = parameters.get("focal_length_mm", 0.0), parameters.get("sensor_size_mm", 0.0)
    if focal_mm > 0 and sensor_mm > 0 and math.isfinite(focal_px := focal_mm / sensor_mm * max(size)):
        return focal_px
    return None


def stated_range_px(parameters: Mapping[str, float]) -> tuple[float, float] | None:
    """Return the least and greatest disparity (px per view step); None if not stated or descending."""
    low, high = parameters.get("disp_min", math.nan), parameters.get("disp_max", math.nan)
    return (low, high) if low <= high else None
