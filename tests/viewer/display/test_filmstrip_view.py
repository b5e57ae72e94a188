"""The filmstrip's pictures are read in the background; one that cannot be read does not hold up the others."""

from __future__ import annotations

from pathlib import Path
from threading import Event

import numpy as np
from PIL import Image

from viewer.display.filmstrip_view import FilmstripView
from viewer.gpu.context import create_headless


def test_an_unexpected_error_costs_one_thumbnail_and_a_light_field_shows_a_view(tmp_path: Path) -> None:
    for name in ("good.png", "field/1.png", "field/2.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Image.fromarray(np.full((20, 30, 3), 128, np.uint8)).save(tmp_path / name)
    paths = ("no\0name.jpg", str(tmp_path / "good.png"), str(tmp_path / "field"))
    gl, news = create_headless(), Event()
    strip = FilmstripView(gl, news.set)
    while len(found := strip.thumbnails(paths)) < 3:
        assert news.wait(60)
        news.clear()
    assert found[paths[0]] is None
    assert found[paths[1]] is not None
    assert found[paths[2]] is not None
    strip.release()
    gl.release()
