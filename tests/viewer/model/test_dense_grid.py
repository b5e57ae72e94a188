"""Views between those of a light field, as the window asks for them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iibr_core.beyond.between_views import require_steps
from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.scenes.scene import FilledField, Scene, Source, source_beside
from iibr_core.types import GridShape, ViewOffset
from viewer.model import messages
from viewer.model.action import ask, do
from viewer.model.actions import OpenPath
from viewer.model.commands import COMMANDS, NOTHING_BETWEEN
from viewer.model.dense_grid import MOST_ACROSS, chosen_grid, denser_grids, next_denser, with_views_between
from viewer.model.reducers.lens_reducer import carry_optics
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.filling import FillTask, ViewsFilled
from viewer.model.state.jobs import STOPPING, JobProgress
from viewer.model.state.notices import Notice

GIVEN, DENSE = GridShape(3, 3), GridShape(5, 5)
FIELD = Scene(Source("field"), "field", 60, 40, GIVEN, (-2.0, 3.0), "light field", given_grid=GIVEN)


@pytest.mark.parametrize("given", [GridShape(3, 3), GridShape(2, 2), GridShape(1, 2), GridShape(9, 5)])
def test_all_grids_that_are_offered_have_places_for_the_given_views(given: GridShape) -> None:
    assert denser_grids(given)
    for grid in denser_grids(given):
        assert require_steps(given, grid) > 1
        assert max(grid) <= MOST_ACROSS


def filling(source: Source, doing: str = "") -> JobProgress:
    return JobProgress(1, "fill", "field", doing, fills=source)


def test_the_grid_that_was_chosen_is_shown_before_its_views_are_there() -> None:
    filled = replace(FIELD, grid=DENSE, source=with_views_between(FIELD, DENSE))
    denser = with_views_between(FIELD, GridShape(9, 9))
    assert chosen_grid(FIELD, FIELD.source, [filling(filled.source), filling(denser)]) == (9, 9)
    assert chosen_grid(FIELD, FIELD.source, [filling(denser, STOPPING)]) == GIVEN
    assert chosen_grid(FIELD, FIELD.source, [filling(replace(denser, path="other"))]) == GIVEN
    assert chosen_grid(filled, with_views_between(filled, GIVEN), []) == GIVEN
    for asked in (None, Source("other.png")):
        assert chosen_grid(filled, asked, []) == DENSE


def filled_field() -> FilledField:
    return FilledField(replace(FIELD, grid=DENSE, source=with_views_between(FIELD, DENSE)), ())


def test_views_between_are_shown_where_their_field_is_open() -> None:
    state = reduce(AppState(source=FIELD.source, scene=FIELD, generation=3), ViewsFilled(filled_field()))
    assert (state.source, state.generation, state.notices) == (Source("field", filled_grid=DENSE), 4, ())


@pytest.mark.parametrize(
    "open_now", [None, Source("other.png"), replace(FIELD.source, depth=DepthChoice(file="a.pfm"))]
)
def test_views_between_are_told_elsewhere_and_found_by_who_goes_back(open_now: Source | None) -> None:
    state = reduce(AppState(source=open_now), ViewsFilled(filled_field()))
    assert (state.source, state.generation) == (open_now, 0)
    assert [notice.stays for notice in state.notices] == [True]
    state = reduce(reduce(state, OpenPath(Source("other.png"))), OpenPath(FIELD.source))
    assert state.source == Source("field", filled_grid=DENSE)
    assert state.filled is not None
    assert state.filled.is_of(state.source)
    assert reduce(state, OpenPath(FIELD.source)).source == FIELD.source, "who already exists asks for those on disk"


@pytest.mark.parametrize(
    "other",
    [
        Source("field2", filled_grid=DENSE),
        Source("field"),
        Source("field", filled_grid=DENSE, inpaint="diffusion:folder"),
        Source("field", filled_grid=DENSE, depth=DepthChoice(file="a.pfm")),
    ],
)
def test_views_between_are_of_one_field_and_one_way_to_make_them(other: Source) -> None:
    assert not filled_field().is_of(other)


def test_nothing_lies_between_one_view_or_very_many() -> None:
    assert denser_grids(GridShape(1, 1)) == denser_grids(GridShape(17, 32)) == ()


def test_each_time_the_next_denser_grid_is_made_of_the_views_on_disk() -> None:
    first = next_denser(FIELD)
    assert first == Source("field", filled_grid=DENSE)
    denser = replace(FIELD, grid=DENSE, source=first)
    assert next_denser(denser) == Source("field", filled_grid=GridShape(9, 9))
    assert with_views_between(denser, GIVEN) == FIELD.source
    assert next_denser(replace(FIELD, grid=GridShape(17, 17))) is None


def test_the_command_tells_where_nothing_lies_between() -> None:
    (command,) = (command for command in COMMANDS if command.name == "Make views between those of a light field")
    photo = replace(FIELD, given_grid=None)
    for scene in (photo, None):
        told = command.action(AppState(scene=scene))
        assert told == do(messages.notify, Notice(NOTHING_BETWEEN))
    opened = command.action(AppState(scene=FIELD))
    assert opened == do(ask, FillTask(Source("field", filled_grid=DENSE)))


def test_the_picture_stays_when_views_between_are_there() -> None:
    """In steps of half the length, all that is counted in steps is twice as much, and disparity half."""
    seen = Optics(eye=ViewOffset(0.5, -1.0), focus_disparity=1.0, focus_range=0.4, aperture_diameter=1.5, dolly=0.1)
    denser = replace(FIELD, grid=DENSE, source=with_views_between(FIELD, DENSE))
    carried = carry_optics(seen, FIELD, denser)
    assert carried.eye == ViewOffset(1.0, -2.0)
    assert (carried.focus_disparity, carried.focus_range, carried.aperture_diameter) == (0.5, 0.2, 3.0)
    assert carry_optics(carried, denser, FIELD) == seen
    assert carry_optics(seen, FIELD, replace(FIELD, source=Source("field"))) == Optics()  # the same file opened again


def test_another_file_is_opened_with_the_views_that_are_in_it() -> None:
    filled = Source("field", grid=DENSE, filled_grid=DENSE)
    assert source_beside(filled, "photo.png") == Source("photo.png", grid=DENSE)
