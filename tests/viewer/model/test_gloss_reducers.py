"""Gloss in the state: what the panel and the brush ask for, undone and redone."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.types import GridShape
from tests.viewer.conftest import reduce
from tests.viewer.model.test_reducers import plan_of, scene_of, state_with
from viewer.model import depth, gesture, history, lens
from viewer.model.action import do
from viewer.model.state.app_state import AppState
from viewer.model.state.depth import Brush
from viewer.model.state.lens import FIRST_GLOSS, GlossBrush

BRUSH = GlossBrush(radius=0.1, is_on=True)


def glossy() -> AppState:
    return reduce(state_with(scene_of()), do(lens.set_gloss, FIRST_GLOSS))


def test_gloss_comes_and_goes_and_outlasts_a_reset_of_the_lens() -> None:
    state = reduce(glossy(), do(lens.reset))
    assert state.optics.gloss == FIRST_GLOSS
    assert reduce(state, do(lens.set_gloss, None)).optics.gloss is None
    assert reduce(glossy(), do(history.undo)).optics.gloss is None


def test_a_stroke_far_beside_the_picture_ends_where_files_allow() -> None:
    state = reduce(glossy(), do(lens.paint_gloss, (-7.0, 3.5), BRUSH, True))
    assert state.optics.gloss is not None
    assert state.optics.gloss.surface.strokes[0].points == ((-1.0, 2.0),)


def test_a_stroke_is_one_edit_and_skips_places_that_are_close() -> None:
    state = glossy()
    for x, begins in ((0.2, True), (0.201, False), (0.3, False)):
        state = reduce(state, do(lens.paint_gloss, (x, 0.5), BRUSH, begins))
    state = reduce(state, do(gesture.end_gesture))
    (stroke,) = state.optics.gloss.surface.strokes  # type: ignore[union-attr]
    assert stroke.points == ((0.2, 0.5), (0.3, 0.5))
    another = reduce(state, do(lens.paint_gloss, (0.7, 0.5), BRUSH, True))
    assert len(another.optics.gloss.surface.strokes) == 2  # type: ignore[union-attr]
    assert reduce(reduce(another, do(gesture.end_gesture)), do(history.undo)).optics == state.optics
    assert (
        reduce(reduce(reduce(another, do(gesture.end_gesture)), do(history.undo)), do(history.undo)).optics.gloss
        == FIRST_GLOSS
    )


def test_painting_without_gloss_does_nothing() -> None:
    state = state_with(scene_of())
    assert reduce(state, do(lens.paint_gloss, (0.5, 0.5), BRUSH, True)).optics == state.optics


def test_there_is_one_brush_in_hand() -> None:
    state = replace(glossy(), scene=scene_of(plan=plan_of(GridShape(9, 9))))
    state = reduce(reduce(state, do(depth.set_brush, Brush(is_on=True))), do(lens.take_gloss_brush, BRUSH))
    assert (state.brush.is_on, state.gloss_brush.is_on) == (False, True)
    state = reduce(state, do(depth.set_brush, Brush(is_on=True)))
    assert (state.brush.is_on, state.gloss_brush.is_on) == (True, False)
