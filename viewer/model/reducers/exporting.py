"""Exports and saves: what is asked for, and where it goes unless the user says otherwise."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.exports import EXPORTS
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt
from viewer.model.state.prompts import Saved, SavePrompt
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


def ask_to_save(state: AppState, what: Saved) -> AppState:
    """Ask where to save the picture, at the photo's own size where it can be drawn so, or the map of a photo."""
    scene = state.scene
    if scene is None or (what == "map" and scene.plan is None):
        return state
    is_full = state.optics.dolly == 0 and state.free_camera is None
    size = (scene.own_size if is_full else None) or scene.size
    return replace(state, prompt=SavePrompt(_path_beside(state, what), size, what=what))


def _path_beside(state: AppState, what: Saved) -> str:
    """Where it is saved unless the user says otherwise: beside the photo. A map is found there the next time, unless
    one was given for it.
    """
    assert state.source is not None
    assert state.scene is not None
    origin = state.scene.depth_origin
    ending = "-iibr.png" if what == "picture" else "_disparity.pfm"
    if what == "map" and origin is not None and origin.kind == "file":
        ending = "-edited.pfm"
    return path_beside(state.source.path, f"{state.scene.name}{ending}")
