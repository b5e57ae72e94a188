"""What people do in a page, by real keys and pointers, in three engines, on a desk and on a phone."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from tests.browsers.page import Page
from tests.web.conftest import canvas
from tests.web.test_page import psnr

SIZES = {"desk": (960, 640), "phone": (390, 844)}
LENS = "['focus', 'aperture'].map(name => document.getElementById(name).valueAsNumber)"
BOX = "(({ x, y, width, height }) => [x, y, width, height])(document.getElementById('view').getBoundingClientRect())"
IS_STILL = "document.documentElement.dataset.state === 'still'"
MOST_MOVED_DB = 40.0
"""Agreement of pictures from different viewpoints at most."""
LEAST_SHOWN_DB = 45.0
"""Agreement of the screen with the canvas, which lies there to a fraction of a pixel."""


@pytest.fixture(params=SIZES.values(), ids=list(SIZES))
def opened(request, engine, page) -> Page:
    engine.resize(*request.param)
    engine.open(page.as_uri())
    engine.wait_until(IS_STILL)
    return engine


def picture(data: bytes) -> np.ndarray:
    with Image.open(BytesIO(data)) as image:
        return np.asarray(image.convert("RGB"))


def test_drags_keys_and_taps_change_the_picture(opened) -> None:
    x, y = (side // 2 for side in opened.evaluate("[innerWidth, innerHeight]"))
    first, lens = canvas(opened), opened.evaluate(LENS)
    for change in (lambda: opened.drag((x, y), (0.9 * x, y), (0.5 * x, y)), lambda: opened.press("ArrowRight", 4)):
        change()
        opened.wait_until(IS_STILL)
        assert psnr(canvas(opened), first) < MOST_MOVED_DB
        opened.press("r")
        opened.wait_until(IS_STILL)
        assert (canvas(opened) == first).all()
    opened.drag((x, y))
    assert opened.evaluate(LENS) > lens, "the square in the middle lies before the plane of focus"
    opened.press("r")
    assert opened.evaluate(LENS) == lens


def test_the_canvas_is_what_the_screen_shows_and_what_is_saved(opened) -> None:
    drawn, (x, y, width, height) = canvas(opened), opened.evaluate(BOX)
    rows, columns = drawn.shape[:2]
    left, top = round(x + (width - columns) / 2), round(y + (height - rows) / 2)
    shown = picture(opened.screenshot())[top : top + rows, left : left + columns]
    middle = slice(rows // 4, 3 * rows // 4)
    assert psnr(shown[middle], drawn[middle]) >= LEAST_SHOWN_DB, "between the words and the bar"
    saved = opened.downloads / "scene.png"
    saved.unlink(missing_ok=True)
    opened.press("s")
    assert (picture(opened.saved_png(saved.name)) == drawn).all()
