"""`iibr export`, as a user runs it: what it writes, what it says, what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.maps.pfm import read_pfm
from tests.viewer.cli.test_cli import run


def test_a_drawn_kind(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    out = tmp_path / "a.gif"
    words = ("--to", "gif", "-o", out, "--grid", 3, "--frames", 3, "--motion", "swing", "--size", "30x20")
    assert run(monkeypatch, "export", photo_path, *words) == 0
    assert capsys.readouterr().out.splitlines() == [str(out)]
    with Image.open(out) as image:
        assert (image.size, image.n_frames) == ((30, 20), 3)  # type: ignore[attr-defined]


def test_the_name_that_is_written_is_the_one_that_must_not_be_there(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    out = tmp_path / "new"
    out.mkdir()
    words = ("export", photo_path, "--to", "half-sbs", "-o", out / "a.png", "--grid", 3)
    assert run(monkeypatch, *words) == 0
    assert capsys.readouterr().out.splitlines() == [str(out / "a_LRF_Half_SBS.png")]
    before = (out / "a_LRF_Half_SBS.png").read_bytes()
    assert run(monkeypatch, *words) == 2
    assert "--force" in capsys.readouterr().err
    assert [(path.name, path.read_bytes()) for path in out.iterdir()] == [("a_LRF_Half_SBS.png", before)]


def test_what_is_read_as_keys_is_not_written_onto(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    keys = tmp_path / "keys.gif"
    keys.write_text("0 0\n0 1\n")
    words = ("export", photo_path, "--to", "gif", "-o", keys, "--path", keys, "--force")
    assert run(monkeypatch, *words) == 2
    assert "keys.gif" in capsys.readouterr().err
    assert keys.read_text() == "0 0\n0 1\n"


def test_a_light_field_of_disparity_as_given(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    out = tmp_path / "field"
    words = ("export", photo_path, "--to", "numbered-grid", "-o", out, "--literal")
    assert run(monkeypatch, *words) == 2
    assert "--grid" in capsys.readouterr().err
    assert run(monkeypatch, *words, "--grid", 5) == 0
    shown = capsys.readouterr()
    assert shown.out.splitlines() == [str(out)]
    assert "In the window it is 4%" in shown.err
    assert len(list(out.glob("v??_u??.png"))) == 25
    assert run(monkeypatch, "export", out, "--to", "eslf", "-o", tmp_path / "a_eslf.png") == 0
    with Image.open(tmp_path / "a_eslf.png") as image:
        assert image.size == (5 * 96, 5 * 64)


def test_disparity_is_found_where_a_light_field_brings_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    field = tmp_path / "field"
    words = ("generate", photo_path, "--grid", 3, "--literal", "--out", field, "--format", "numbered-grid")
    assert run(monkeypatch, *words) == 0
    given = read_pfm(field / "disp_est_u01_v01.pfm")
    for path in field.glob("*.pfm"):
        path.unlink()
    (field / "parameters.cfg").unlink()
    assert run(monkeypatch, "export", field, "--to", "disparity", "-o", tmp_path / "a.pfm") == 0
    assert np.median(np.abs(read_pfm(tmp_path / "a.pfm") - given)) < 0.3
    assert run(monkeypatch, "export", field, "--to", "hci", "-o", tmp_path / "hci") == 0
    assert sorted(path.suffix for path in (tmp_path / "hci").iterdir()) == [".cfg"] + 9 * [".png"]
