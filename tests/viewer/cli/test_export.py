"""`iibr export`, as a user runs it: what it writes, what it says, what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import DISPLAY_P3, SRGB
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


def test_a_light_field_of_disparity_as_given(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    out = tmp_path / "field"
    words = ("export", photo_path, "--to", "hci", "-o", out, "--literal")
    assert run(monkeypatch, *words) == 2
    assert "--grid" in capsys.readouterr().err
    assert run(monkeypatch, *words, "--grid", 5) == 0
    shown = capsys.readouterr()
    assert shown.out.splitlines() == [str(out)]
    assert "In the window it is 4%" in shown.err
    assert len(list(out.glob("input_Cam*.png"))) == 25
    assert run(monkeypatch, "export", out, "--to", "eslf", "-o", tmp_path / "a_eslf.png") == 0
    with Image.open(tmp_path / "a_eslf.png") as image:
        assert image.size == (5 * 96, 5 * 64)


def test_disparity_is_found_where_a_light_field_brings_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    field = tmp_path / "field"
    words = ("generate", photo_path, "--grid", 3, "--literal", "--out", field)
    assert run(monkeypatch, *words) == 0
    given = read_pfm(field / "gt_disp_lowres.pfm")
    for path in field.glob("*.pfm"):
        path.unlink()
    (field / "parameters.cfg").unlink()
    assert run(monkeypatch, "export", field, "--to", "disparity", "-o", tmp_path / "a.pfm") == 0
    assert np.median(np.abs(read_pfm(tmp_path / "a.pfm") - given)) < 0.3
    assert run(monkeypatch, "export", field, "--to", "hci", "-o", tmp_path / "hci") == 0
    assert sorted(path.suffix for path in (tmp_path / "hci").iterdir()) == [".cfg"] + 9 * [".png"]


@pytest.mark.parametrize("kind", ["cross-eyed", "focal-stack", "quilt", "rgbd"])
def test_pictures_have_the_photos_colours_and_words(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str) -> None:
    """A Display P3 photo is exported in Display P3, unless displays ignore profiles; its place is never written."""
    photo, out = tmp_path / "photo.jpg", tmp_path / ("out" if kind.startswith("focal") else "out.png")
    exif = Image.Exif()
    exif[0x010F] = "Maker"
    exif.get_ifd(0x8825).update({1: "N", 2: (1.0, 2.0, 3.0)})
    plain = Image.new("RGB", (48, 32), (200, 80, 60))
    plain.save(photo, exif=exif, icc_profile=icc_profile(DISPLAY_P3), quality=100, subsampling=0)
    words = ("export", photo, "--to", kind, "-o", out, "--grid", 3, "--depth", "flat")
    assert run(monkeypatch, *words, *(("--bits", 16) if kind.startswith("focal") else ())) == 0
    picture = out / "all_in_focus.png" if kind.startswith("focal") else next(tmp_path.glob("out*.png"))
    with Image.open(picture) as image:
        said = image.getexif()
        profile = image.info["icc_profile"]
    assert said[0x010F] == "Maker"
    assert not said.get_ifd(0x8825)
    is_wide = kind in ("cross-eyed", "focal-stack")
    assert profile == icc_profile(DISPLAY_P3 if is_wide else SRGB)
    pixels = oiio.ImageBuf(str(picture)).get_pixels(oiio.FLOAT) * 255
    np.testing.assert_allclose(pixels[16, 4], (200, 80, 60) if is_wide else (216, 69, 50), atol=2.5)
