"""Scenes as their publishers pack them become a folder that the benchmarks read."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks import lay_out
from benchmarks.scenes import data_scenes


def picture(path: Path, value: int, mode: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new(mode, (450, 375), value if mode == "L" else (value,) * 3).save(path)


def test_archives_and_folders_become_scenes_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    downloads, unpacked, data = tmp_path / "downloads", tmp_path / "unpacked", tmp_path / "data"
    for names, folder in ((("im2", "im6"), downloads / "teddy"), (("view1", "view5"), unpacked / "Moebius")):
        for name in names:
            picture(folder / f"{name}.png", 90, "RGB")
            picture(folder / f"disp{name[-1]}.png", 80, "L")
    with zipfile.ZipFile(downloads / "Moebius-2views.zip", "w") as archive:
        for path in unpacked.rglob("*.png"):
            archive.write(path, path.relative_to(unpacked))
    monkeypatch.setattr(sys, "argv", ["benchmarks lay_out", str(downloads), str(data)])
    lay_out.main()
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if "laid out (Middlebury, 2 views)" in line] == lines[1:3]
    assert "0 of 82 files found; get https://" in lines[3]
    scenes = {scene.name: scene for scene in data_scenes(data)}
    assert np.unique(scenes["mb2003_teddy_quarter"].disparity) == pytest.approx(80 / 4 / 4 * 424 / 450, rel=0.01)
    assert set(scenes) == {"mb2003_teddy_quarter", "mb2005_moebius_third"}
    lay_out.main()
    assert "mb2003_teddy_quarter: is there already" in capsys.readouterr().out
