"""What becomes of a path that the user chose, in a dialog or by typing it."""

from __future__ import annotations

from viewer.model.actions import Action, DoTask, OpenPath
from viewer.model.state.app_state import (
    AppState,
    ChoiceOf,
    ReadMaskTask,
    ReadTruthTask,
    source_beside,
    source_with_depth,
    source_with_map,
)


def action_for_path(what: ChoiceOf, path: str, state: AppState) -> Action:
    """What a path that the user chose is for."""
    match what:
        case "mask":
            return DoTask(ReadMaskTask(path))
        case "truth":
            return DoTask(ReadTruthTask(path))
        case "map" if state.source is not None:
            return OpenPath(source_with_map(state.source, path))
        case "model" if state.source is not None:
            return OpenPath(source_with_depth(state.source, "model", path))
    return OpenPath(source_beside(state.source, path))
