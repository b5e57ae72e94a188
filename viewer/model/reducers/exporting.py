"""Exports: what is asked for, and where it goes unless the user says otherwise."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.exports import EXPORTS
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt
from viewer.model.state.saving import path_beside

FIRST_KIND = next(iter(EXPORTS))


def ask_to_export(state: AppState) -> AppState:
    """With the question; as it is where nothing is open."""
    if state.scene is None:
        return state
    return replace(state, prompt=ExportPrompt(FIRST_KIND, export_path_beside(state, FIRST_KIND)))


def export_path_beside(state: AppState, kind: str) -> str:
    """Beside the photo."""
    assert state.source is not None
    assert state.scene is not None
    ending = EXPORTS[kind].endings[0] if EXPORTS[kind].endings else ""
    return path_beside(state.source.path, f"{state.scene.name}-{kind}{ending}")
