"""The filmstrip's pictures are read in the background; one that cannot be read does not hold up the others."""

from threading import Event

import numpy as np
from PIL import Image

from viewer.display.filmstrip_view import FilmstripView
from viewer.gpu.context import create_headless

RED, GREEN = (200, 30, 20), (20, 180, 40)
"""Colours of the upper and the lower half of the pictures."""


def colours_of(gl, thumbnail):
    """Return the colours of a thumbnail of 30x20 pixels in its first and last row."""
    assert thumbnail.aspect == 1.5
    texture = gl.ctx.external_texture(thumbnail.texture, (30, 20), 3, 0, "f1")
    pixels = np.frombuffer(texture.read(alignment=1), np.uint8).reshape(20, 30, 3)
    return [tuple(row[15].tolist()) for row in pixels[[0, -1]]]


def test_an_unexpected_error_costs_one_thumbnail_and_a_light_field_shows_a_view(tmp_path):
    for name in ("good.png", "field/1.png", "field/2.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        halves = (RED, GREEN) if name == "good.png" else (GREEN, RED)
        Image.fromarray(np.array(halves, np.uint8).repeat(10, 0)[:, None].repeat(30, 1)).save(tmp_path / name)
    paths = ("no\0name.jpg", str(tmp_path / "good.png"), str(tmp_path / "field"))
    gl, news = create_headless(), Event()
    strip = FilmstripView(gl, news.set)
    while len(found := strip.thumbnails(paths)) < 3:
        assert news.wait(60)
        news.clear()
    assert found[paths[0]] is None
    assert colours_of(gl, found[paths[1]]) == [RED, GREEN]
    assert colours_of(gl, found[paths[2]]) == [GREEN, RED]
    for first in range(0, 300, 100):  # more than are kept
        shown = paths[1], *(f"no\0name {number}.jpg" for number in range(first, first + 100))
        while len(found := strip.thumbnails(shown)) < len(shown):
            assert paths[1] in found, "as long as it is seen"
            assert news.wait(60)
            news.clear()
    strip.release()
    gl.release()
