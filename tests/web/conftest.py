"""A small scene as a page, a browser that shows it, and the desktop's pictures of the same."""

import base64
import math
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.browsers.chromium import Pipe, Tab, open_browser
from tests.browsers.engines import ENGINES, open_engine
from tests.browsers.local_site import LocalSite, serve_site
from tests.browsers.page import Page
from tests.viewer.conftest import HEIGHT, WIDTH, write_scene
from viewer.cli.main import app

STILL = "document.documentElement.dataset.state === 'still' && document.getElementById('status').textContent === ''"
OpenPage = Callable[..., Tab]


def export(scene: Path, *words: str, grid: str = "3") -> Path:
    page = scene.with_suffix(".html")
    app(
        ["export", str(scene), "--to", "web", "--grid", grid, "-o", str(page), "--force", *words], standalone_mode=False
    )
    return page


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scene(tmp_path_factory.mktemp("scene"))


@pytest.fixture(scope="session")
def page(scene: Path) -> Path:
    return export(scene)


@pytest.fixture(scope="session")
def site() -> Iterator[LocalSite]:
    with serve_site() as site:
        yield site


@pytest.fixture(scope="session", params=ENGINES)
def engine(request: pytest.FixtureRequest, site: LocalSite) -> Iterator[Page]:
    """Return the page of a browser, one engine after the other."""
    with open_engine(request.param, site) as page:
        yield page


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


@pytest.fixture
def shown(tab: Tab, page: Path) -> Tab:
    tab.resize(WIDTH, HEIGHT)
    tab.open(page.as_uri())
    wait_until_still(tab)
    return tab


def wait_until_still(tab: Tab) -> None:
    tab.wait_until(STILL)
    assert tab.complaints == []


def slide(tab: Page, name: str, value: float) -> None:
    tab.evaluate(
        f"(slider => {{ slider.value = {value}; slider.dispatchEvent(new Event('input')) }})"
        f"(document.getElementById('{name}'))"
    )


def slide_aperture(tab: Page, aperture: float) -> None:
    """By the slider, which is in stops: 6 are the widest, 0 a pinhole. aperture: view steps."""
    widest = tab.evaluate("JSON.parse(document.getElementById('field').textContent).apertureLimits[1]")
    slide(tab, "aperture", 6 + math.log2(aperture / widest) if aperture else 0.0)


def set_lens(tab: Page, s: float, t: float, focus: float, aperture: float) -> None:
    """By keys, a quarter of a view step each, and the sliders."""
    tab.press("Home")
    tab.press("ArrowRight" if s > 0 else "ArrowLeft", round(4 * abs(s)))
    tab.press("ArrowDown" if t > 0 else "ArrowUp", round(4 * abs(t)))
    slide(tab, "focus", focus)
    slide_aperture(tab, aperture)


def canvas(tab: Page) -> np.ndarray:
    url = tab.evaluate("document.getElementById('view').toDataURL()")
    with Image.open(BytesIO(base64.b64decode(url.partition(",")[2]))) as image:
        return np.asarray(image.convert("RGB"))
