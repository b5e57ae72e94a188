"""Ways of looking in a real window: the whole screen, no panel, before and after, a kept state, help at first."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import SMALL_WINDOW, Driver, Opener
from viewer.display.inspection_view import ROUNDING
from viewer.model import messages
from viewer.model.action import do
from viewer.model.inspection_request import DIFFERENCE_GAIN
from viewer.model.state.inspection import Compare, KeepState
from viewer.model.state.optics_actions import MoveEye, SetAperture, SetOptics
from viewer.ui.overlays.reticle import pointer_text


def test_f11_fills_the_screen_and_escape_comes_back_to_where_it_was(viewer: Driver) -> None:
    place = viewer.app.state.preferences.window
    viewer.send("key", "F11")
    viewer.until(lambda app: app.window.is_fullscreen and app.window.size == (1400, 900))
    viewer.until_idle()
    assert viewer.app.state.preferences.window == place, "a place to come back to"
    viewer.send("key", "Escape")
    viewer.until(lambda app: not app.window.is_fullscreen and app.window.size == SMALL_WINDOW[2:])
    assert not viewer.app.state.should_quit


def test_tab_gives_the_panels_room_to_the_picture(viewer: Driver) -> None:
    before = viewer.app.layout().picture
    viewer.send("key", "Tab")
    viewer.until(lambda app: app.layout().panel.width == 0)
    viewer.until_idle()
    after = viewer.app.layout().picture
    assert before is not None
    assert after is not None
    assert after.width > 1.3 * before.width
    viewer.send("key", "Tab")
    viewer.until(lambda app: app.layout().picture == before)


def test_before_is_the_photo_until_the_key_or_an_edit_ends_it(viewer: Driver) -> None:
    photo = viewer.image()
    viewer.app.do(SetAperture(3.0), SetOptics("exposure_stops", 1.0), MoveEye(ViewOffset(0, 1)))
    viewer.until_idle()
    edited = viewer.image()
    viewer.send("key", "backslash")
    viewer.until(lambda app: app.state.shows_before)
    viewer.until_idle()
    np.testing.assert_allclose(viewer.image().astype(int), photo, atol=ROUNDING)
    viewer.send("key", "backslash")
    viewer.until(lambda app: not app.state.shows_before)
    viewer.until_idle()
    np.testing.assert_allclose(viewer.image().astype(int), edited, atol=ROUNDING)
    viewer.send("key", "backslash")
    viewer.until(lambda app: app.state.shows_before)
    viewer.send("key", "Right")
    viewer.until(lambda app: not app.state.shows_before)


def test_a_kept_state_is_compared_side_by_side_and_as_a_difference(viewer: Driver) -> None:
    viewer.app.do(Compare("difference"))
    assert viewer.app.state.inspection.comparison is None
    assert "no snapshot yet" in viewer.app.state.notices[-1].text
    viewer.app.do(do(messages.dismiss), SetAperture(2.0))
    viewer.until_idle()
    kept = viewer.image()
    viewer.app.do(KeepState(), Compare("difference"))
    viewer.until_idle()
    assert not shown(viewer, "difference").any(), "nothing differs yet"
    viewer.app.do(SetOptics("exposure_stops", -0.5))
    viewer.until_idle()
    expected = np.abs(viewer.image().astype(int) - kept) * DIFFERENCE_GAIN
    np.testing.assert_allclose(shown(viewer, "difference"), np.minimum(expected, 255), atol=2 * DIFFERENCE_GAIN)
    viewer.app.do(Compare("kept"))
    viewer.until_idle()
    np.testing.assert_allclose(shown(viewer, "left").astype(int), kept, atol=2)


def shown(viewer: Driver, name: str) -> np.ndarray:
    """What lies over the picture under this name."""
    texture = viewer.app.inspection_view._passes._textures[name]
    width, height = texture.size
    return np.frombuffer(texture.read(alignment=1), np.uint8).reshape(height, width, -1)[..., :3]


def test_the_hint_at_the_pointer_goes_with_the_first_drag_for_ever(
    open_window: Opener, photo_path: Path, tmp_path: Path
) -> None:
    first = open_window(photo_path, kept_in=tmp_path / "kept", grid=GridShape(3, 3))
    first.until_idle()
    first.send("mousemove", *first.position(0.5, 0.5))
    first.until(lambda app: app.state.hover is not None)
    assert words_at_pointer(first) == "Drag to look"
    assert first.app.state.prompt is None
    first.send("mousedown", 1, "mousemove", *first.position(0.7, 0.5))
    first.until(lambda app: app.state.optics.eye.s != 0)
    first.send("mouseup", 1)
    first.until(lambda app: app.state.hover is not None)
    assert "Drag" not in words_at_pointer(first)
    first.close()
    second = open_window(photo_path, kept_in=tmp_path / "kept", grid=GridShape(3, 3))
    second.until_idle()
    second.send("mousemove", *second.position(0.5, 0.5))
    second.until(lambda app: app.state.hover is not None)
    assert "Drag" not in words_at_pointer(second)


def words_at_pointer(driver: Driver) -> str:
    state = driver.app.state
    assert state.scene is not None
    assert state.hover is not None
    return pointer_text(state, state.scene, state.hover)
