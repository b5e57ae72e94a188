"""Actions are verbs of the model with their arguments."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.action import ask, do
from viewer.model.history import undo, undoable
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import ListModelsTask


@undoable
def set_strength(state: AppState, strength: float) -> AppState:
    return replace(state, depth_strength=strength)


def test_an_action_calls_its_verb_and_equals_another_with_the_same_arguments() -> None:
    action = do(set_strength, 2.0)
    assert action.apply(AppState()).depth_strength == 2.0
    assert action == do(set_strength, 2.0) != do(set_strength, 3.0)
    assert do(set_strength, strength=3.0).apply(AppState()).depth_strength == 3.0


def test_steps_of_one_gesture_are_one_edit() -> None:
    state = set_strength(set_strength(AppState(), 2.0), 3.0)
    assert undo(state).depth_strength == 1.0


def test_a_task_waits_in_the_state() -> None:
    assert ask(ask(AppState(), ListModelsTask()), ListModelsTask()).tasks == (ListModelsTask(), ListModelsTask())
