"""Inspection as pure functions: verbs, layout beside the picture, words."""

from dataclasses import replace

import pytest

from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import reduce
from viewer.model import inspection, opening, window
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME
from viewer.model.inspection import Hover, Inspection, Probe, beside_of, sheet_cells, view_at, view_near
from viewer.model.layout import Beside, layout_of
from viewer.model.preferences import Preferences
from viewer.ui.overlays.inspection_overlay import legend_words, status_text
from viewer.ui.overlays.reticle import hover_text

GRID = GridShape(5, 7)
PLAN = ScenePlan(GRID, 1.0, 0.0, (-1.0, 2.0), 0.1, True, 0, 0, ())
SCENE = Scene(Source("a.png"), "a", 60, 40, GRID, (-1.0, 2.0), "a.pfm", plan=PLAN)
FOLDER = replace(SCENE, plan=None)
OPEN = AppState(source=SCENE.source, scene=SCENE, generation=3)


def test_an_overlay_and_a_comparison_take_turns():
    state = inspection.set_overlay(inspection.compare(OPEN, "photo"), "entropy")
    assert (state.inspection.overlay, state.inspection.comparison) == ("entropy", None)
    state = inspection.compare(state, "photo")
    assert (state.inspection.overlay, state.inspection.comparison) == (None, "photo")
    assert replace(state, inspection=OPEN.inspection) == OPEN, "looking costs nothing"
    for name in ("Overlay: depth", "Compare with the photo", "EPI strips"):
        shown = reduce(OPEN, BY_NAME[name].action(OPEN))
        assert shown.inspection != OPEN.inspection
        assert reduce(shown, BY_NAME[name].action(shown)).inspection == OPEN.inspection


def test_opacity_and_divider_are_held_within_the_picture():
    assert inspection.set_opacity(OPEN, 3.0).inspection.opacity == 1
    assert 0 < inspection.move_divider(OPEN, -5).inspection.divider < 0.1
    held = inspection.move_divider(OPEN, 5)
    assert 0.9 < held.inspection.divider < 1
    assert held.inspection.divider_taken
    assert not window.end_gesture(held).inspection.divider_taken


@pytest.mark.parametrize("kind", ["entropy", "inpainted"])
def test_views_from_disk_have_no_maps_of_how_they_were_made(kind):
    state = replace(OPEN, scene=FOLDER)
    refused = inspection.set_overlay(state, kind)
    assert refused.inspection == state.inspection
    assert len(refused.notices) == 1
    assert inspection.set_overlay(state, "disparity").inspection.overlay == "disparity"
    flat = replace(OPEN, scene=replace(FOLDER, has_view_disparity=False))
    assert inspection.set_overlay(flat, "disparity").inspection.overlay is None


def test_a_snapshot_is_needed_before_it_is_compared():
    refused = inspection.compare(OPEN, "snapshot")
    assert refused.inspection == OPEN.inspection
    assert [notice.text for notice in refused.notices] == [inspection.NO_SNAPSHOT]
    taken = inspection.take_snapshot(OPEN)
    (notice,) = taken.notices
    compared = reduce(taken, BY_NAME[notice.commands[0]].action(taken))
    assert (compared.inspection.comparison, compared.inspection.snapshot) == ("snapshot", OPEN.optics)
    assert not compared.notices, "the advice was followed"


def test_the_next_scene_is_looked_at_in_the_same_way_without_the_findings():
    state = inspection.take_snapshot(inspection.show_epis(OPEN, True))
    state = inspection.compare(inspection.set_hover(state, Hover(3, 4, 0.5)), "snapshot")
    opened = opening.show_scene(state, 3, replace(SCENE, source=Source("b.png")))
    assert opened.inspection == Inspection(shows_epis=True)


def test_the_place_pointed_at_last_stays_and_its_values_go():
    probe = Probe((1, 2, 3), "photo")
    state = inspection.set_probe(inspection.set_hover(OPEN, Hover(3, 4, 0.5)), probe)
    assert inspection.set_hover(state, Hover(5, 6, 0.5)).inspection.probe == probe, "until the next are known"
    left = inspection.set_hover(state, None).inspection
    assert (left.place, left.probe) == ((3, 4), None)


@pytest.mark.parametrize(
    ("eye", "view"), [((0, 0), (2, 3)), ((-9, 9), (0, 6)), ((0.6, -1.4), (3, 2)), ((1e30, -1e30), (4, 0))]
)
def test_the_view_near_the_eye(eye, view):
    assert view_near(ViewOffset(*eye), GRID) == view


def test_strips_take_their_room_beside_the_picture_and_line_up_with_it():
    plain = layout_of((900, 700), (60, 40))
    single = replace(OPEN, scene=replace(SCENE, grid=GridShape(1, 1)))
    views = [beside_of(inspection.show_epis(state, True)).epi_views for state in (single, OPEN)]
    assert views == [None, (5, 7)], "a single view has no EPIs"
    layout = layout_of((900, 700), (60, 40), 2.0, 1.0, Beside((5, 9), has_status=True))
    picture, across, down, status = layout.picture, layout.strip_across, layout.strip_down, layout.status
    assert plain.strip_across is plain.strip_down is plain.status is None
    assert picture.width / picture.height == pytest.approx(1.5)
    assert (across.x, across.width) == (picture.x, picture.width)
    assert (down.y, down.height) == (picture.y, picture.height)
    assert across.height / 9 >= 6, "every view several pixels"
    assert down.width / 5 >= 6
    assert picture.y + picture.height < across.y
    assert across.y + across.height <= status.y
    assert status.y + status.height < 700
    assert down.x + down.width < layout.panel.x
    assert layout.in_pixels(across)[2] == layout.in_pixels(picture)[2]
    tiny = layout_of((360, 100), (60, 40), beside=Beside((9, 9), has_status=True))
    assert tiny.picture is tiny.strip_across is tiny.status is None


@pytest.mark.parametrize("grid", [GridShape(1, 1), GridShape(3, 9), GridShape(17, 17)])
def test_a_click_on_the_sheet_finds_the_view_drawn_there(grid):
    picture = Rect(12, 30, 600, 400)
    for i, cell in enumerate(sheet_cells(picture, grid)):
        assert cell.width / cell.height == pytest.approx(1.5)
        assert view_at(picture, grid, 1.0, cell.x + cell.width / 2, cell.y + 1) == divmod(i, grid.columns)
        assert picture.contains(cell.x, cell.y)
        assert picture.contains(cell.x + cell.width, cell.y + cell.height)
    assert view_at(picture, grid, 1.0, picture.x, picture.y) is None


def test_values_under_the_pointer_in_the_units_of_the_panel():
    numbers = replace(OPEN, preferences=Preferences(units="light field"))
    hover, probe = Hover(12.3, 4.0, -0.5), Probe((1, 20, 255), "inpainted")
    assert status_text(OPEN, SCENE, hover, None) == ["12, 4", hover_text(OPEN.optics, SCENE, hover)]
    assert "px" not in hover_text(OPEN.optics, SCENE, hover)
    words = ["12, 4", "−0.50 px", "0.50 behind", "inpainted", "RGB 1 20 255"]
    assert status_text(numbers, SCENE, hover, probe) == words
    assert status_text(OPEN, SCENE, replace(hover, disparity=None), probe) == ["12, 4", "inpainted", "RGB 1 20 255"]


def test_the_legend_speaks_the_units_of_the_panel():
    shown, ends = inspection.set_overlay(OPEN, "disparity"), (-1.5, 2.0)
    assert legend_words(shown, SCENE, ends) == ("distance", ["far", "near"])
    numbers = replace(shown, preferences=Preferences(units="light field"))
    assert legend_words(numbers, SCENE, ends) == ("px per step", ["−1.50", "2.00"])
    in_metres = replace(SCENE, inverse_metres=(0.1, 0.2))
    assert legend_words(shown, in_metres, ends) == ("distance", ["20 m", "2.50 m"])
    assert legend_words(inspection.set_overlay(OPEN, "entropy"), SCENE, (0.0, 1.0)) == ("entropy", ["0.00", "1.00"])
