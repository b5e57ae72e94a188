"""The filmstrip's pictures are read in the background; one that cannot be read does not hold up the others."""

from __future__ import annotations

from pathlib import Path
from threading import Event

import numpy as np
from PIL import Image

from viewer.display.filmstrip_view import FilmstripView
from viewer.gpu.context import create_headless


def test_an_unexpected_error_costs_one_thumbnail(tmp_path: Path) -> None:
    good = tmp_path / "good.png"
    Image.fromarray(np.full((20, 30, 3), 128, np.uint8)).save(good)
    paths = ("no\0name.jpg", str(good))
    gl, news = create_headless(), Event()
    strip = FilmstripView(gl, news.set)
    while len(found := strip.thumbnails(paths)) < 2:
        assert news.wait(60)
        news.clear()
    assert found[paths[0]] is None
    assert found[paths[1]] is not None
    strip.release()
    gl.release()
