"""Gloss in a real window: switched on, the light dragged, painted with the brush, and what each edit costs."""

import numpy as np
import pytest

OPEN_SECTIONS = ("gloss",)


def shown_gloss(driver):
    gloss = driver.app.state.optics.gloss
    return gloss


def make_glossy(driver):
    """Switch gloss on, and wait until it is seen: what it means is found out beside the window."""
    driver.press("Glossy surface")
    driver.until(lambda app: app.state.optics.gloss is not None)
    driver.settle(lambda app: app.scene_view.gloss_request(app.state.optics.gloss) is None)


def test_a_surface_is_made_glossy_its_light_dragged_and_both_taken_back(viewer):
    plain = viewer.image()
    make_glossy(viewer)
    shiny = viewer.image()
    assert np.abs(shiny.astype(int) - plain).max() > 3
    previews = viewer.app.scene_view.previews
    x, y = viewer.find("light ball")
    viewer.send("mousemove", x, y, "mousedown", 1)
    viewer.app.step()
    viewer.send("mousemove", x + 300, y + 300)
    viewer.until(lambda app: min(app.state.optics.gloss.light.direction[:2]) > 0.3)
    viewer.send("mouseup", 1)
    viewer.until_idle()
    assert not np.array_equal(viewer.image(), shiny)
    assert viewer.app.scene_view.previews == previews, "the light needs no new maps"
    viewer.send("key", "ctrl+z")
    viewer.send("key", "ctrl+z")
    viewer.settle(lambda app: app.state.optics.gloss is None)
    assert np.array_equal(viewer.image(), plain)


def test_the_brush_marks_what_it_runs_over_and_esc_puts_it_away(viewer):
    make_glossy(viewer)
    viewer.press("Only brush strokes")
    viewer.press("Mark")
    viewer.until_idle()
    eye = viewer.app.state.optics.eye
    viewer.send("mousemove", *viewer.position(0.3, 0.5), "mousedown", 1)
    viewer.app.step()
    viewer.send("mousemove", *viewer.position(0.6, 0.5))
    viewer.until(lambda app: len(app.state.optics.gloss.surface.strokes[-1:]) == 1)
    viewer.send("mouseup", 1)
    viewer.until_idle()
    (stroke,) = shown_gloss(viewer).surface.strokes
    assert stroke.points[0] == pytest.approx((0.3, 0.5), abs=0.02)
    assert viewer.app.state.optics.eye == eye
    viewer.send("key", "Escape")
    viewer.until(lambda app: not app.state.gloss_brush.is_on)
