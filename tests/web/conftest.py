"""A small scene as a page, a browser that shows it, and the desktop's pictures of the same."""

import base64
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.browser import Pipe, Tab, open_browser
from viewer.cli.main import app

STILL = "document.documentElement.dataset.state === 'still' && document.getElementById('status').textContent === ''"
ARROWS = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Home": 36}
OpenPage = Callable[..., Tab]


def export(scene: Path, *words: str, grid: str = "3") -> Path:
    page = scene.with_suffix(".html")
    app(
        ["export", str(scene), "--to", "web", "--grid", grid, "-o", str(page), "--force", *words], standalone_mode=False
    )
    return page


@pytest.fixture(scope="session")
def browser() -> Iterator[Pipe]:
    with open_browser() as browser:
        yield browser


@pytest.fixture
def tab(browser) -> Iterator[Tab]:
    tab = browser.new_tab()
    tab.prefer(prefers_reduced_motion="reduce")
    yield tab
    tab.close()


def wait_until_still(tab: Tab) -> None:
    tab.wait_until(STILL)
    assert tab.complaints == []


def press(tab: Tab, key: str, times: int = 1) -> None:
    for _ in range(times):
        for kind in ("keyDown", "keyUp"):
            tab.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=ARROWS.get(key, 0))


def slide(tab: Tab, name: str, value: float) -> None:
    tab.evaluate(
        f"(slider => {{ slider.value = {value}; slider.dispatchEvent(new Event('input')) }})"
        f"(document.getElementById('{name}'))"
    )


def set_lens(tab: Tab, s: float, t: float, focus: float, aperture: float) -> None:
    """By keys, a quarter of a view step each, and the sliders."""
    press(tab, "Home")
    press(tab, "ArrowRight" if s > 0 else "ArrowLeft", round(4 * abs(s)))
    press(tab, "ArrowDown" if t > 0 else "ArrowUp", round(4 * abs(t)))
    slide(tab, "focus", focus)
    slide(tab, "aperture", aperture)


def canvas(tab: Tab) -> np.ndarray:
    url = tab.evaluate("document.getElementById('view').toDataURL()")
    with Image.open(BytesIO(base64.b64decode(url.partition(",")[2]))) as image:
        return np.asarray(image.convert("RGB"))
