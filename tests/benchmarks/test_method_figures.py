"""The figures of docs/method.md, drawn from a small demo photo."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.figures import METHOD
from benchmarks.method_figures import main


def test_every_figure_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["method_figures", "--out", str(tmp_path), "--max-pixels", "30000"])
    main()
    assert {path.stem for path in tmp_path.iterdir()} == {*METHOD}
    for path in tmp_path.iterdir():
        with Image.open(path) as picture:
            assert picture.width > 500
            assert len(np.unique(np.asarray(picture))) > 20
