"""What each inspection action does to the state. What cannot be had for the open scene is a notice, nothing else."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.scene import Scene
from viewer.model.messages import notify
from viewer.model.state.app_state import AppState, Hover
from viewer.model.state.inspection import (
    Compare,
    Comparison,
    GroundTruth,
    InspectionAction,
    KeepState,
    MoveDivider,
    OverlayKind,
    PairCompared,
    SetInspection,
    SetOverlay,
    TruthRead,
)
from viewer.model.state.notices import Notice
from viewer.model.state.tasks import ChooseTask

DIVIDER_MARGIN = 0.02
"""The divider stays so far (share of the picture's width) from its borders, where it could not be taken again."""

NOT_MADE_HERE = "Only of views that were made here: these were read from disk."
NOTHING_KEPT = "There is no snapshot yet: take one first (K)."
KEPT = "Snapshot taken. Change the picture, then compare with it: side by side, or as a difference."
KEPT_COMMANDS = ("Compare with the snapshot", "Difference from the snapshot")
NO_DISPARITY = "These views come without depth."


def reduce_inspection(state: AppState, action: InspectionAction) -> AppState:
    """The state after an inspection action."""
    match action:
        case SetInspection("opacity", float(opacity)):
            return _with(state, opacity=clamp(opacity, 0.0, 1.0)) if math.isfinite(opacity) else state
        case SetInspection(field, value):
            return _with(state, **{field: value})
        case SetOverlay(kind):
            return _set_overlay(state, kind)
        case Compare(comparison):
            return _set_comparison(state, comparison)
        case KeepState() if state.scene is not None:
            return notify(_with(state, kept=state.optics), Notice(KEPT, commands=KEPT_COMMANDS))
        case MoveDivider(place) if math.isfinite(place):
            return _with(state, divider=clamp(place, DIVIDER_MARGIN, 1 - DIVIDER_MARGIN), divider_taken=True)
        case TruthRead(truth):
            return _set_truth(state, truth)
        case PairCompared(pair) if pair.kind == state.inspection.comparison and pair.generation == state.generation:
            return _with(state, pair=pair)
    return state


def release_divider(state: AppState) -> AppState:
    """The pointer went up: the divider is not held any more."""
    return _with(state, divider_taken=False) if state.inspection.divider_taken else state


def move_pointer(state: AppState, hover: Hover | None) -> AppState:
    """The pointer is here. Where it was last in the picture is remembered, and what was found elsewhere is not."""
    if hover is None:
        return _with(replace(state, hover=None), probe=None)
    return _with(replace(state, hover=hover), place=(hover.x_px, hover.y_px))


def obstacle_to_overlay(scene: Scene, kind: OverlayKind) -> str:
    """Why this cannot be laid over the picture; empty where it can."""
    if kind != "disparity" and scene.plan is None:
        return NOT_MADE_HERE
    return "" if scene.has_view_disparity else NO_DISPARITY


def lacks_kept_state(state: AppState, kind: Comparison) -> bool:
    """Whether a state must be kept before this can be compared."""
    return kind in ("kept", "difference") and state.inspection.kept is None


def misfit(truth: GroundTruth, scene: Scene) -> str:
    """Why this ground truth cannot be held against the scene, a sentence; empty where it can.

    The views of a photo are made where the ground truth has its own; those of a light field must be the same ones.
    """
    if (truth.width, truth.height) != (scene.width, scene.height):
        return (
            f"{truth.path}: views of {truth.width}x{truth.height} px cannot be compared with {scene.name}, "
            f"which is {scene.width}x{scene.height}; choose ground truth of that size"
        )
    if scene.plan is None and truth.grid != scene.grid:
        return (
            f"{truth.path}: {truth.grid.rows}x{truth.grid.columns} views cannot be compared with the "
            f"{scene.grid.rows}x{scene.grid.columns} of {scene.name}; choose ground truth of that grid"
        )
    return ""


def _set_overlay(state: AppState, kind: OverlayKind | None) -> AppState:
    if kind is None or state.scene is None:
        return _with(state, overlay=None)
    obstacle = obstacle_to_overlay(state.scene, kind)
    return notify(state, Notice(obstacle)) if obstacle else _with(state, overlay=kind, comparison=None, pair=None)


def _set_comparison(state: AppState, kind: Comparison | None) -> AppState:
    if kind is None or state.scene is None:
        return _with(state, comparison=None, pair=None, divider_taken=False)
    if kind == "truth" and state.inspection.truth is None:
        return replace(state, tasks=(*state.tasks, ChooseTask("truth")))
    if lacks_kept_state(state, kind):
        return notify(state, Notice(NOTHING_KEPT))
    advised = tuple(notice for notice in state.notices if notice.text != KEPT)  # is done now
    return _with(replace(state, notices=advised), comparison=kind, overlay=None, pair=None)


def _set_truth(state: AppState, truth: GroundTruth) -> AppState:
    if state.scene is None:
        return state
    problem = misfit(truth, state.scene)
    if problem:
        return notify(state, Notice(problem, is_error=True))
    return _with(state, truth=truth, comparison="truth", overlay=None, pair=None)


def _with(state: AppState, **changes: Any) -> AppState:
    inspection = replace(state.inspection, **changes)
    return state if inspection == state.inspection else replace(state, inspection=inspection)
