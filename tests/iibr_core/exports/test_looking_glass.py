import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from iibr_core.exports import quilt
from iibr_core.exports.kinds import EXPORTS, ExportOptions
from iibr_core.exports.source import write_export
from iibr_core.formats.lenticular import parse_calibration
from iibr_core.types import InputError
from tests.fake_bridge import MONITOR, PORTRAIT, TOKEN, FakeBridge, fake_bridge
from tests.iibr_core.exports.conftest import exported

SHOWING = ["show_window", "delete_playlist", "instance_playlist", "insert_playlist_entry", "play_playlist"]


@pytest.fixture
def bridge(monkeypatch) -> Iterator[FakeBridge]:
    with fake_bridge(monkeypatch) as server:
        yield server


def test_a_quilt_is_shown(bridge, source, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    options = ExportOptions(show=True)
    assert write_export(EXPORTS["quilt"], Path("a_qs8x6a1.5.png"), source, options) == "It is shown on the display."
    (out,) = tmp_path.glob("a_qs8x6a*.png")
    asked = [endpoint for endpoint, _ in bridge.requests]
    assert asked == ["enter_orchestration", "available_output_devices", *SHOWING]
    assert all(body["orchestration"] == TOKEN for _, body in bridge.requests[1:])
    entry = dict(bridge.requests)["insert_playlist_entry"]
    assert entry["uri"] == str(out), "an absolute path: Bridge has another working folder"
    assert (entry["cols"], entry["rows"], entry["view_count"], entry["aspect"]) == (8, 6, 48, 1.5)
    assert dict(bridge.requests)["play_playlist"]["head_index"] == -1
    assert dict(bridge.requests)["show_window"]["show_window"] is True


TROUBLE = {
    "nothing": ({"server_port": 1}, "Looking Glass Bridge does not answer"),
    "no display": ({"displays": [MONITOR]}, "sees no display"),
    "old": ({"raw": {"enter_orchestration": b""}}, "enter_orchestration .no answer"),
    "failing": ({"failing": {"play_playlist"}}, "play_playlist .Failure"),
}


@pytest.mark.parametrize("trouble", TROUBLE)
def test_failures_are_one_line(bridge, source, tmp_path, trouble, monkeypatch) -> None:
    changes, message = TROUBLE[trouble]
    for name, value in changes.items():
        setattr(bridge, name, value)
    monkeypatch.setattr(quilt, "ADDRESS", f"localhost:{bridge.server_port}")
    with pytest.raises(InputError, match=message) as error:
        exported(source, "quilt", tmp_path / "a.png", show=True)
    assert "\n" not in str(error.value)
    assert bool(list(tmp_path.iterdir())) == (trouble == "failing"), "Bridge answers before anything is drawn"


CALIBRATION = {"pitch": 52, "slope": -7, "center": 0.5, "DPI": 324, "screenW": 1536, "screenH": 2048}


def reported(calibration: object, place: object = None) -> dict[str, object]:
    """A display as Bridge reports it."""
    return PORTRAIT | {"calibration": {"value": calibration}, "windowCoords": {"value": place}}


def test_bridge_reports_how_the_lenses_of_its_first_display_lie(bridge) -> None:
    text = json.dumps({key: {"value": value} for key, value in CALIBRATION.items()})
    bridge.displays = [MONITOR, reported(text, {"x": -1536, "y": 20}), reported("{}")]
    display, place = quilt.Bridge().first_display()
    assert (display, place) == (parse_calibration(text, "a"), (-1536, 20))
    bridge.displays = [reported(text, {"x": "left"})]
    assert quilt.Bridge().first_display()[1] is None


@pytest.mark.parametrize("text", [None, 3, "", "{}", "\0"])
def test_a_display_without_a_calibration_is_named(bridge, text: object) -> None:
    bridge.displays = [reported(text)]
    with pytest.raises(InputError, match=r"^the display that Bridge reports: "):
        quilt.Bridge().first_display()
