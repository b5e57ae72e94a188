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
SENSOR_SIZE_MM = 36.0


def read_parameters(folder: Path) -> dict[str, float]:
    """Every number of the folder's parameters by name, whatever its section; empty if there is no file.

    Raises InputError for a file that is too large or no text with sections.
    """
    path = folder / FILE_NAME
    if not is_file(path) or path.stat().st_size == 0:
        return {}
    text = read_text(path)
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string(text)
    except configparser.Error as error:
        raise InputError(f"{path}: is not a valid parameter file ({reason_of(error)}); correct or remove it") from error
    numbers: dict[str, float] = {}
    for section in parser.sections():
        for key, text in parser.items(section):
            with suppress(ValueError):
                if math.isfinite(number := float(text)):
                    numbers[key] = number
    return numbers


def stated_grid(parameters: Mapping[str, float]) -> GridShape | None:
    """The numbers of cameras, which need not make sense; None where neither is stated."""
    rows, columns = int(parameters.get("num_cams_y", 0)), int(parameters.get("num_cams_x", 0))
    return GridShape(rows, columns) if rows or columns else None


def stated_focal_px(parameters: Mapping[str, float], size: ImageSize) -> float | None:
    """The focal length in pixels of a view of this size, None where it is not stated or makes no sense."""
    focal_mm, sensor_mm = parameters.get("focal_length_mm", 0.0), parameters.get("sensor_size_mm", 0.0)
    if focal_mm > 0 and sensor_mm > 0 and math.isfinite(focal_px := focal_mm / sensor_mm * max(size)):
        return focal_px
    return None


def stated_range_px(parameters: Mapping[str, float]) -> tuple[float, float] | None:
    """The least and greatest disparity (px per view step), None where they are not stated or make no sense."""
    if "disp_min" in parameters and "disp_max" in parameters and parameters["disp_min"] <= parameters["disp_max"]:
        return parameters["disp_min"], parameters["disp_max"]
    return None


def write_parameters(
    folder: Path, name: str, grid: GridShape, size: ImageSize, focal_px: float, range_px: tuple[float, float]
) -> None:
    """The benchmark's parameters.cfg. One photo tells no baseline: 1 mm by decree, which fixes the scale of depths.

    range_px: least and greatest disparity (px per view step); infinite where there is none.
    """
    low, high = range_px if math.isfinite(range_px[0]) else (0.0, 0.0)
    # Farthest point at infinity; 0 says that the cameras are focused there too.
    focus_m = focal_px / -low / 1000 if low < 0 else 0.0
    parser = configparser.ConfigParser(interpolation=None)
    parser["intrinsics"] = {
        "focal_length_mm": repr(focal_px * SENSOR_SIZE_MM / max(size)),
        "image_resolution_x_px": str(size.width),
        "image_resolution_y_px": str(size.height),
        "sensor_size_mm": repr(SENSOR_SIZE_MM),
        "fstop": "100.0",
    }
    parser["extrinsics"] = {
        "num_cams_x": str(grid.columns),
        "num_cams_y": str(grid.rows),
        "baseline_mm": "1.0",
        "focus_distance_m": repr(focus_m),
        **{f"center_cam_{axis}": "0.0" for axis in ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")},
        "offset": "0",
    }
    parser["meta"] = {
        "scene": " ".join(name.split()),
        "category": "iibr",
        "disp_min": repr(low),
        "disp_max": repr(high),
        "depth_map_scale": "1.0",
    }
    with (folder / FILE_NAME).open("w", encoding="utf-8") as file:
        parser.write(file)
