"""The figures of docs/method.md, drawn from a small demo photo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.method_figures import main
from benchmarks.report import ROOT


def test_every_figure_is_drawn(tmp_path: Path) -> None:
    main([str(tmp_path), "--max-pixels", "30000"])
    assert {path.name for path in tmp_path.iterdir()} == {
        path.name for path in (ROOT / "docs" / "method").glob("*.png")
    }
    for path in tmp_path.iterdir():
        with Image.open(path) as picture:
            assert picture.width > 500
            assert len(np.unique(np.asarray(picture))) > 20
