"""A page whose graphics driver fails, or whose screen has more pixels than its views."""

from pathlib import Path

import numpy as np
import pytest

from tests.browser import Tab
from tests.viewer.conftest import HEIGHT, WIDTH, write_scene
from tests.web.conftest import canvas, export, set_lens, wait_until_still

GL = "document.getElementById('view').getContext('webgl2')"


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    return export(write_scene(tmp_path_factory.mktemp("scene")))


@pytest.fixture
def shown(tab, page) -> Tab:
    tab.resize(WIDTH, HEIGHT)
    tab.open(page.as_uri())
    wait_until_still(tab)
    return tab


def test_a_lost_context_comes_back_with_views_and_lens(shown) -> None:
    set_lens(shown, 0.5, -0.25, 0.2, 1.5)
    wait_until_still(shown)
    before = canvas(shown)
    shown.evaluate(f"(globalThis.loss = {GL}.getExtension('WEBGL_lose_context')).loseContext()")
    shown.wait_until("document.getElementById('status').textContent.includes('graphics driver stopped')")
    assert shown.evaluate("document.getElementById('view').hidden"), "the first picture shows meanwhile"
    shown.evaluate("delete document.documentElement.dataset.views")
    shown.evaluate("loss.restoreContext()")
    shown.wait_until("document.documentElement.dataset.views === '9'")
    wait_until_still(shown)
    assert not shown.evaluate("document.getElementById('view').hidden")
    assert np.array_equal(canvas(shown), before)
