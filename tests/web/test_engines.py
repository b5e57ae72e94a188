"""What people do in a page, by real keys and pointers, in three engines, on a desk and on a phone."""

from collections.abc import Iterator
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from iibr_core.exports.web import hash_of, page_script
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape
from tests.browsers.page import Page
from tests.web.conftest import STILL, canvas, set_lens
from tests.web.test_page import MIN_PSNR_DB, MIN_WITH_APERTURE_DB, SETTINGS, psnr, set_desktop_lens
from viewer.display.offscreen import OffscreenScene

SIZES = {"desk": (720, 480), "phone": (390, 844)}
LENS = "['focus', 'aperture'].map(name => document.getElementById(name).valueAsNumber)"
BOX = "(({ x, y, width, height }) => [x, y, width, height])(document.getElementById('view').getBoundingClientRect())"
IS_STILL = "document.documentElement.dataset.state === 'still'"
MAX_MOVED_DB = 40.0
"""Agreement of pictures from different viewpoints at most."""
MIN_SHOWN_DB = 45.0
"""Agreement of the screen with the canvas, stretched to a fraction of a pixel: 50.8 dB were measured at least."""


@pytest.fixture(params=SIZES.values(), ids=list(SIZES))
def opened(request, engine, page) -> Page:
    engine.resize(*request.param)
    engine.open(page.as_uri())
    engine.wait_until(IS_STILL)
    return engine


def picture(data: bytes) -> np.ndarray:
    with Image.open(BytesIO(data)) as image:
        return np.asarray(image.convert("RGB"))


@pytest.fixture(scope="module")
def desktop(scene) -> Iterator[OffscreenScene]:
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(scene), grid=GridShape(3, 3)))
        yield viewer


def agreement(page: Page, desktop: OffscreenScene, setting: tuple[float, float, float, float]) -> float:
    """Return the PSNR of the canvas against the desktop's picture of the same size, when all views are there."""
    page.wait_until(STILL)
    assert page.evaluate("+document.documentElement.dataset.views") == 9
    set_lens(page, *setting)
    set_desktop_lens(desktop, *setting)
    page.wait_until(STILL)
    drawn = canvas(page)
    return psnr(drawn, desktop.picture(ScreenSize(*drawn.shape[1::-1])))


def test_all_views_arrive_and_look_as_on_the_desktop(opened, desktop) -> None:
    pinhole, aperture = SETTINGS[1:3]
    assert agreement(opened, desktop, pinhole) >= MIN_PSNR_DB
    assert agreement(opened, desktop, aperture) >= MIN_WITH_APERTURE_DB


def test_views_arrive_where_the_context_is_insecure(engine, site, page, desktop) -> None:
    """So is a page from a server of the local network: Chromium and Firefox have no VideoDecoder there."""
    site.pages["/scene.html"] = page.read_bytes()
    engine.resize(*SIZES["phone"])
    engine.open("http://name.test/scene.html")
    assert not engine.evaluate("isSecureContext")
    assert agreement(engine, desktop, SETTINGS[1]) >= MIN_PSNR_DB


def test_views_arrive_right_where_decoders_fail(engine, page, tmp_path, desktop) -> None:
    """WebKitGTK draws the frames of a video 2 to 3 levels too dark."""
    script = page_script()
    changed = script.replace("decoder.configure(VP9)", "decoder.close()")
    text = page.read_text("utf-8").replace(script, changed).replace(hash_of(script), hash_of(changed))
    (tmp_path / "scene.html").write_text(text, "utf-8")
    engine.resize(*SIZES["phone"])
    engine.open((tmp_path / "scene.html").as_uri())
    assert agreement(engine, desktop, SETTINGS[1]) >= MIN_PSNR_DB


def test_drags_keys_and_taps_change_the_picture(opened) -> None:
    x, y = (side // 2 for side in opened.evaluate("[innerWidth, innerHeight]"))
    first, lens = canvas(opened), opened.evaluate(LENS)
    for change in (lambda: opened.drag((x, y), (0.9 * x, y), (0.5 * x, y)), lambda: opened.press("ArrowRight", 4)):
        change()
        opened.wait_until(IS_STILL)
        assert psnr(canvas(opened), first) < MAX_MOVED_DB
        opened.press("r")
        opened.wait_until(IS_STILL)
        assert (canvas(opened) == first).all()
    opened.drag((x, y))
    assert opened.evaluate(LENS) > lens, "the square in the middle lies before the plane of focus"
    opened.press("r")
    assert opened.evaluate(LENS) == lens


def test_the_canvas_is_what_the_screen_shows_and_what_is_saved(opened) -> None:
    drawn, (x, y, width, height) = canvas(opened), opened.evaluate(BOX)
    scale = min(width / drawn.shape[1], height / drawn.shape[0])
    rows, columns = (round(scale * side) for side in drawn.shape[:2])
    left, top = round(x + (width - columns) / 2), round(y + (height - rows) / 2)
    shown = picture(opened.screenshot())[top : top + rows, left : left + columns]
    stretched = np.asarray(Image.fromarray(drawn).resize((columns, rows), Image.Resampling.BILINEAR))
    middle = slice(rows // 4, rows // 2)
    assert psnr(shown[middle], stretched[middle]) >= MIN_SHOWN_DB, "between the words and the bar"
    saved = opened.downloads / "scene.png"
    saved.unlink(missing_ok=True)
    opened.press("s")
    assert (picture(opened.saved_png(saved.name)) == drawn).all()
