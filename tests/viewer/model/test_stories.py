"""Stories of what people do: golden texts tell what each action changes, to be read by a person.

Each line of a golden text is a field that an action changed, or ("=") what another part of the program derives of it.
"""

import pytest

from tests.golden_text import assert_same_text
from tests.viewer.model import picture_stories, scene_stories
from tests.viewer.model.told import EXACT, title, told
from viewer.model import history
from viewer.model.action import Action

STORIES = picture_stories.STORIES | scene_stories.STORIES


def can_be_undone(before, after):
    """Return what undo restores of two states; None where the action was no edit of its own."""
    is_edit = len(after.history.past) == len(before.history.past) + 1 and after.scene is before.scene
    kept = [(state.optics, state.depth_strength, state.depth) for state in (before, after)]
    return kept if is_edit and kept[0] != kept[1] else None


@pytest.mark.parametrize("name", STORIES)
def test_each_action_changes_what_it_says_and_can_be_undone(name, regenerate_golden):
    state, actions = STORIES[name]
    lines = []
    for each in actions:
        action = each if isinstance(each, Action) else each(state)
        before, state = state, action.apply(state)
        lines += [title(action), *(f"    {line}" for line in told(before, state))]
        if action.verb not in (history.undo, history.redo) and (kept := can_be_undone(before, state)):
            undone = history.undo(state)
            redone = history.redo(undone)
            assert kept == [(each.optics, each.depth_strength, each.depth) for each in (undone, redone)]
    assert_same_text(lines, "viewer/stories", name, regenerate_golden, *EXACT)
