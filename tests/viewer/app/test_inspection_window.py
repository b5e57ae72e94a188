"""Inspection in a real window: keys, clicks, drags and drops; what each costs; scores when all is still."""

from imgui_bundle import imgui

from iibr_core.beyond.optics import Optics
from iibr_core.types import GridShape, ViewOffset
from viewer.model import preferences
from viewer.model.action import do
from viewer.model.inspection import sheet_cells

GRID = GridShape(5, 5)


def test_epis_follow_the_pointer_and_cost_no_picture(viewer):
    viewer.send("key", "e")
    viewer.settle(lambda app: app.state.inspection.shows_epis)
    app = viewer.app
    assert app.layout().strip_across is not None
    shown = app.inspection_view.draw(app.state, app.layout())
    assert shown.strip_across is not None
    drawn, frames = app.scene_view.pictures_drawn, app.frames_shown
    viewer.send("mousemove", *viewer.position(0.5, 0.6))
    viewer.settle(lambda app: app.state.hover is not None and app.state.hover.y_px > 30)
    moved = app.inspection_view.draw(app.state, app.layout())
    assert moved != shown
    assert app.scene_view.pictures_drawn == drawn
    assert app.frames_shown > frames
    frames = app.frames_shown
    for _ in range(3):
        app.step()
    assert app.frames_shown == frames, "idle draws nothing"


def test_a_click_on_the_sheet_goes_to_the_view_and_escape_leaves_it(viewer):
    viewer.send("key", "g")
    viewer.until(lambda app: app.state.inspection.shows_views)
    picture = viewer.app.layout().picture
    cell = sheet_cells(picture, GRID)[1 * GRID.columns + 4]
    viewer.send("mousemove", round(cell.x + cell.width / 2), round(cell.y + cell.height / 2), "click", 1)
    viewer.settle(lambda app: app.state.optics.eye == ViewOffset(-1, 2))
    assert viewer.app.state.optics == Optics(eye=ViewOffset(-1, 2)), "nothing was focused"
    assert viewer.app.state.inspection.shows_views
    viewer.send("key", "Escape")
    viewer.until(lambda app: not app.state.inspection.shows_views)
    assert not viewer.app.state.should_quit


def test_the_divider_is_dragged_and_the_viewpoint_stays(viewer):
    viewer.send("key", "p")
    viewer.until(lambda app: app.state.inspection.comparison == "photo")
    x, y = viewer.position(0.5, 0.7)
    viewer.send("mousemove", x, y, "mousedown", 1)
    viewer.app.step()
    viewer.send("mousemove", x - 20, y)
    viewer.app.step()
    viewer.send("mousemove", *viewer.position(0.2, 0.7))
    viewer.until(lambda app: abs(app.state.inspection.divider - 0.2) < 0.01)
    assert viewer.app.state.inspection.divider_taken
    viewer.send("mouseup", 1)
    viewer.until(lambda app: not app.state.inspection.divider_taken)
    assert viewer.app.state.optics == Optics()
    viewer.send("mousemove", *viewer.position(0.2, 0.4), "click", 1)
    viewer.until_idle()
    assert viewer.app.state.optics == Optics(), "a click on the divider focuses nothing"


def test_maps_and_values_come_and_tooltips_leave_a_dragged_slider_alone(viewer):
    sections = ("more", "view", "focus", "aperture", "light", "inspect")
    viewer.do(*(do(preferences.toggle_section, section) for section in sections))
    viewer.press("Values")
    viewer.until(lambda app: app.layout().status is not None)
    viewer.press("Entropy")
    viewer.until(lambda app: app.inspection_view.draw(app.state, app.layout()).overlay is not None)
    viewer.find("##Opacity")
    viewer.send("mousedown", 1)
    viewer.until(lambda app: imgui.is_any_item_active())
    viewer.app.step()
    tip = imgui.internal.find_window_by_name("##Tooltip_00")
    assert tip is None or not tip.active, "the picture is what matters while a slider is dragged"
    viewer.send("mouseup", 1, "mousemove", *viewer.position(0.5, 0.5))
    viewer.until(lambda app: app.state.inspection.probe is not None)
    assert viewer.app.state.inspection.probe.origin == "photo"
    viewer.send("mousemove", round(viewer.app.layout().panel.x + 30), 500)
    viewer.until(lambda app: app.state.inspection.probe is None)
