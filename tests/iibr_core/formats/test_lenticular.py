import json
import math
from pathlib import Path
from typing import Any

import pytest

from iibr_core.formats.lenticular import MAX_CELLS, STRIPES, parse_calibration, read_calibration
from iibr_core.formats.quilts import DEVICES, SCREENS
from iibr_core.types import ImageSize, InputError

PORTRAIT: dict[str, Any] = {
    "configVersion": "1.0", "serial": "LKG-PORT-00000", "pitch": {"value": 52.0}, "slope": {"value": -7.0},
    "center": {"value": 0.5}, "viewCone": {"value": 40.0}, "invView": {"value": 1.0}, "verticalAngle": {"value": 0.0},
    "DPI": {"value": 324.0}, "screenW": {"value": 1536.0}, "screenH": {"value": 2048.0}, "flipImageX": {"value": 0.0},
    "flipImageY": {"value": 0.0}, "flipSubp": {"value": 0.0},
}  # fmt: skip
CELL = {f"{color}Offset{axis}": 0.25 for color in "RGB" for axis in "XY"}


def test_a_display_states_its_lenses(tmp_path: Path) -> None:
    (tmp_path / "visual.json").write_text(json.dumps(PORTRAIT), "utf-8-sig")
    display = read_calibration(tmp_path / "visual.json")
    across, up = display.lenses_per_px
    assert math.hypot(across, up) == pytest.approx(52 / 324), "lenses are counted across them"
    assert across / up == pytest.approx(-7)
    assert (display.screen, display.cells, display.is_inverted) == (ImageSize(2048, 1536), (STRIPES,), True)
    assert display.quilt == DEVICES["portrait"]
    mirrored = parse_calibration(json.dumps(PORTRAIT | {"flipImageX": 1}), "a")
    assert (mirrored.lenses_per_px, mirrored.is_mirrored) == ((across, -up), (True, False)), "so do its lenses"


def test_values_may_stand_alone_and_defaults_are_those_of_all_displays() -> None:
    wanted = "pitch", "slope", "center", "DPI", "screenW", "screenH"
    short = {key: PORTRAIT[key]["value"] for key in wanted}
    assert parse_calibration(json.dumps(short), "a") == parse_calibration(json.dumps(PORTRAIT), "a")
    assert parse_calibration(json.dumps(PORTRAIT | {"flipSubp": 1}), "a").cells == (STRIPES[::-1],), "blue comes first"


def test_the_quilt_has_the_shape_of_the_screen() -> None:
    for screen, name in SCREENS.items():
        assert DEVICES[name].aspect == pytest.approx(screen.width / screen.height, rel=1e-3)
    older = PORTRAIT | {"screenW": 2560, "screenH": 1600}
    quilt = parse_calibration(json.dumps(older), "a").quilt
    assert quilt.views >= 45
    assert quilt.aspect == 1.6


FAULTS = {
    "pitch": ({"pitch": None}, "pitch is missing"),
    "not a number": ({"pitch": {"value": math.nan}}, "pitch is nan, not a number from 1 to 1000"),
    "infinite": ({"center": {"value": math.inf}}, "center is inf"),
    "words": ({"slope": {"value": "steep\n"}}, r"slope is steep\?"),
    "true": ({"DPI": True}, "DPI is True"),
    "nothing": ({"DPI": 0}, "DPI is 0"),
    "huge": ({"screenW": {"value": 10**400}}, "screenW is 1000"),
    "level": ({"slope": {"value": 0.01}}, "slope is 0.01, so the lenses lie along the rows"),
    "pattern": ({"CellPatternMode": {"value": 5}}, "CellPatternMode is 5"),
    "many": ({"subpixelCells": [CELL] * (MAX_CELLS + 1)}, "at most 16 cells"),
    "no cells": ({"subpixelCells": {"value": 3}}, "at most 16 cells"),
    "half": ({"subpixelCells": [{"ROffsetX": 0.1}]}, "ROffsetY is missing"),
    "far": ({"subpixelCells": [CELL | {"BOffsetY": 1e9}]}, "BOffsetY is 1000000000.0"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_named_with_its_value(name: str) -> None:
    changes, message = FAULTS[name]
    with pytest.raises(InputError, match=f"^a display: .*{message}.*; get the file visual.json") as error:
        parse_calibration(json.dumps(PORTRAIT | changes), "a display")
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300
    for text in ("", "{", "[" * 10_000, "[]", '"pitch"', "null", '{"pitch": 1e999}', "\0"):
        with pytest.raises(InputError, match=r"^a\.json: "):
            parse_calibration(text, "a.json")
