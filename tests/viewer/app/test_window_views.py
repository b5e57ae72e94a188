"""Ways of looking in a real window: the whole screen, no panel, before and after, a kept state, help at first."""

import numpy as np

from iibr_core.types import ViewOffset
from tests.viewer.conftest import SMALL_WINDOW
from viewer.model import inspection, lens
from viewer.model.action import do

ROUNDING = 1
"""Largest difference between equal pictures that were drawn in other steps, of 255."""


def test_f11_fills_the_screen_and_tab_gives_the_panels_room_to_the_picture(viewer):
    place = viewer.app.state.preferences.window
    viewer.send("key", "F11")
    viewer.settle(lambda app: app.window.is_fullscreen and app.window.size == (1400, 900))
    assert viewer.app.state.preferences.window == place, "a place to come back to"
    assert viewer.app.layout().panel.width == 0
    viewer.send("key", "Escape")
    viewer.until(lambda app: not app.window.is_fullscreen and app.window.size == SMALL_WINDOW[2:])
    assert viewer.app.layout().panel.width > 0
    assert not viewer.app.state.should_quit
    viewer.until_idle()
    before = viewer.app.layout().picture
    viewer.send("key", "Tab")
    viewer.settle(lambda app: app.layout().panel.width == 0)
    after = viewer.app.layout().picture
    assert after.width > 1.3 * before.width
    viewer.send("key", "Tab")
    viewer.until(lambda app: app.layout().picture == before)


def test_before_is_the_photo_until_the_key_or_an_edit_ends_it(viewer):
    photo = viewer.image()
    viewer.do(do(lens.set_aperture, 3.0), do(lens.set_exposure, 1.0), do(lens.move_eye, ViewOffset(0, 1)))
    edited = viewer.image()
    viewer.send("key", "backslash")
    viewer.settle(lambda app: app.state.shows_before)
    np.testing.assert_allclose(viewer.image().astype(int), photo, atol=ROUNDING)
    viewer.send("key", "backslash")
    viewer.settle(lambda app: not app.state.shows_before)
    np.testing.assert_allclose(viewer.image().astype(int), edited, atol=ROUNDING)
    viewer.send("key", "backslash")
    viewer.until(lambda app: app.state.shows_before)
    viewer.send("key", "Right")
    viewer.until(lambda app: not app.state.shows_before)


def test_a_snapshot_is_compared_side_by_side(viewer):
    viewer.do(do(lens.set_aperture, 2.0))
    before = viewer.image()
    viewer.app.do(do(inspection.take_snapshot), do(lens.set_exposure, -0.5), do(inspection.compare, "snapshot"))
    viewer.until(lambda app: app.inspection_view.is_drawing)  # over several turns: the window answers meanwhile
    viewer.until_idle()
    np.testing.assert_allclose(shown(viewer, "snapshot").astype(int), before, atol=2)


def shown(viewer, name):
    """What lies over the picture under this name."""
    texture = viewer.app.inspection_view._passes._textures[name]
    width, height = texture.size
    return np.frombuffer(texture.read(alignment=1), np.uint8).reshape(height, width, -1)[..., :3]
