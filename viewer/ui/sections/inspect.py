"""The panel's section for looking into the light field: EPIs, views, values, overlays, comparisons and scores."""

from __future__ import annotations

import math
from typing import Literal

from imgui_bundle import imgui

from iibr_core.scenes.scene import Scene
from viewer.model.action import ask, do
from viewer.model.actions import Action
from viewer.model.commands import OVERLAY_WORDS
from viewer.model.inspection_request import grid_to_compare, view_label, view_to_compare
from viewer.model.layout import Layout
from viewer.model.reducers.inspection_reducer import (
    NOTHING_KEPT,
    lacks_kept_state,
    obstacle_to_overlay,
)
from viewer.model.state.app_state import AppState
from viewer.model.state.inspection import (
    COMPARISONS,
    OVERLAYS,
    Compare,
    Comparison,
    OverlayKind,
    SetInspection,
    SetOverlay,
)
from viewer.model.state.preferences import SetPreference
from viewer.model.state.tasks import ChooseTask
from viewer.ui.widgets import button, checkbox, choice, in_row, percent_slider, quiet

EPI_TIP = (
    "Epipolar plane images through the pointer (E): one line of the picture from every view, a surface slopes the more"
    " the nearer."
)
OVERLAY_TIPS: dict[OverlayKind, str] = {
    "disparity": "How near everything is, as colours.",
    "entropy": "How undecided the weights of the rays are: 1 where no ray of the photo shows anything.",
    "inpainted": "What the photo does not show, so that it was inpainted.",
}
OPACITY_TIP = "How much of the picture the colours cover."
TRUTH_TIP = "A light field on disk to compare with."
COMPARISON_WORDS: dict[Comparison, str] = {
    "photo": "Photo",
    "truth": "Truth",
    "kept": "Snapshot",
    "difference": "Difference",
}
COMPARISON_TIPS: dict[Comparison, str] = {
    "photo": "The photo beside the picture.",
    "truth": "The view nearest to the viewpoint beside the same one of a light field on disk. Drop its folder on the "
    "panel, or press again to choose another one.",
    "kept": "The picture as it was at the snapshot (K), beside the present one.",
    "difference": "How far the present picture is from the snapshot (K).",
}


def inspect_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section."""
    return (
        _units(state, layout)
        + _toggles(state, layout)
        + _overlays(state, scene, layout)
        + _comparisons(state, scene, layout)
    )


def score_text(psnr_db: float | None, flip: float | None) -> str:
    """PSNR and FLIP in one line: "41.2 dB PSNR, 0.031 FLIP", PSNR alone where there is no FLIP; "identical" where
    nothing differs.
    """
    if psnr_db is None:
        return "PSNR and FLIP follow when all is still"
    if math.isinf(psnr_db):
        return "identical"
    return f"{psnr_db:.2f} dB PSNR" + (f", {flip:.4f} FLIP" if flip is not None else "")


def _units(state: AppState, layout: Layout) -> list[Action]:
    """The one place where the units of the whole panel are chosen."""
    is_on = state.preferences.units == "light field"
    tip = "Focus as disparity in px per view step, the aperture in view steps: everywhere in the window."
    chosen = checkbox("Units of light fields", is_on, layout, tip)
    return [] if chosen is None else [SetPreference("units", "light field" if chosen else "photographic")]


def _toggles(state: AppState, layout: Layout) -> list[Action]:
    inspection = state.inspection
    row = [
        ("EPIs", inspection.shows_epis, EPI_TIP, ""),
        ("Views", inspection.shows_grid, "All views; click one to go there (G)", ""),
        ("Values", inspection.shows_values, "What is under the pointer, in a line below (V)", ""),
    ]
    pressed = _choices(row, layout)
    fields: tuple[Literal["shows_epis", "shows_grid", "shows_values"], ...] = "shows_epis", "shows_grid", "shows_values"
    return [] if pressed is None else [SetInspection(fields[pressed], not row[pressed][1])]


def _overlays(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    imgui.text("Over the picture")
    chosen = state.inspection.overlay
    row = [
        (OVERLAY_WORDS[k].capitalize(), chosen == k, OVERLAY_TIPS[k], obstacle_to_overlay(scene, k)) for k in OVERLAYS
    ]
    # In two rows: four buttons in one are cut at small sizes.
    half = len(row) // 2
    upper, lower = _choices(row[:half], layout), _choices(row[half:], layout)
    pressed = upper if lower is None else half + lower
    actions: list[Action] = []
    if pressed is not None:
        actions.append(SetOverlay(None if chosen == OVERLAYS[pressed] else OVERLAYS[pressed]))
    opacity = percent_slider("Opacity", state.inspection.opacity, layout, OPACITY_TIP, chosen is not None)
    return actions + ([] if opacity is None else [SetInspection("opacity", opacity)])


def _comparisons(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    imgui.text("Compare with")
    inspection = state.inspection
    chosen = inspection.comparison
    row = [
        (
            COMPARISON_WORDS[k],
            chosen == k,
            COMPARISON_TIPS[k],
            NOTHING_KEPT if lacks_kept_state(state, k) else "",
        )
        for k in COMPARISONS
    ]
    # In two rows: four buttons in one are cut at small sizes.
    half = len(row) // 2
    upper, lower = _choices(row[:half], layout), _choices(row[half:], layout)
    pressed = upper if lower is None else half + lower
    actions: list[Action] = []
    if pressed is not None:
        actions.append(Compare(None if chosen == COMPARISONS[pressed] else COMPARISONS[pressed]))
    truth = inspection.truth
    if button("Truth…", layout, TRUTH_TIP if truth is None else truth.path):
        actions.append(do(ask, ChooseTask("truth")))
    if truth is not None:
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        quiet(truth.name)
    quiet(pair_text(state, scene, chosen) if chosen == "truth" else " ")
    return actions


def pair_text(state: AppState, scene: Scene, kind: Comparison) -> str:
    """Which view is compared, and how far its two images are apart."""
    truth, pair = state.inspection.truth, state.inspection.pair
    grid, wanted = grid_to_compare(scene, kind, truth), view_to_compare(scene, state.optics.eye, kind, truth)
    if pair is None or pair.view != wanted:
        return f"Making the {view_label(wanted, grid)}…"
    words = view_label(pair.view, grid)
    return f"{words[0].upper()}{words[1:]}: {score_text(pair.psnr_db, pair.flip)}"


def _choices(row: list[tuple[str, bool, str, str]], layout: Layout) -> int | None:
    """A row of lit buttons (word, is lit, tip, why not) as wide as the panel; which was pressed."""
    pressed = None
    for (i, (word, is_on, tip, obstacle)), width in in_row(tuple(enumerate(row)), layout):
        imgui.begin_disabled(bool(obstacle))
        if choice(word, is_on, layout, (width, 0), obstacle or tip):
            pressed = i
        imgui.end_disabled()
    return pressed
