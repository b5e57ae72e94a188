"""A page whose graphics driver fails, or whose screen has more pixels than its views."""

import numpy as np

from tests.web.conftest import canvas, set_lens, wait_until_still

GL = "document.getElementById('view').getContext('webgl2')"


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
