"""The panel's section for depth: source, tone and files. `depth_brush` has the rows of the brush."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.choice import DepthStart
from iibr_core.depth.editing.edits import GAMMA_LIMITS, UNEDITED
from iibr_core.scenes.scene import Scene, source_with_depth
from viewer.model import depth, depth_models, inspection, opening, preferences, saving
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.remedies import BETTER_DEPTH
from viewer.model.tasks import ChooseTask, ask
from viewer.ui.sections.depth_brush import brush_rows, selection_rows
from viewer.ui.sections.depth_histogram import depth_histogram
from viewer.ui.widgets import (
    SPACING,
    button,
    checkbox,
    combo,
    edit,
    gap,
    label,
    last_part,
    lines,
    quiet,
    scale,
    slider,
    tooltip,
)

START_WORDS: dict[DepthStart, str] = {
    "auto": "Automatic",
    "embedded": "From the photo's file",
    "model": "Depth model",
    "rough": "Rough guess",
    "flat": "Flat",
}
START_TIPS: dict[DepthStart, str] = {
    "auto": "A map beside the photo, else depth in the photo's file, else a depth model, else a guess.",
    "embedded": "Depth that the camera stored in the file, as phones do with portraits.",
    "model": "A model on this computer estimates depth from the picture.",
    "rough": "Guessed from outlines and height in the picture. Near and far may be wrong.",
    "flat": "Everything is equally far away, so nothing moves.",
}
SOURCE_TIP = "Source of depth. Another choice opens the photo again."
REFINE_TIP = "Move depth edges to the photo's edges. Exact maps stay as they are."
FAR_TIP = "Bring everything farther than this to this depth. The left handle above does the same."
NEAR_TIP = "Push everything nearer than this to this depth. The right handle above does the same."
GAMMA_TIP = "Above 1, near things stand out more; below 1, far things do."
NEAR_END_TIP = "Values of the map that count as near. Invert swaps near and far."
ORIGIN_LINES = 2
ENDS = ("the high end", "the low end"), ("white", "black")
END_WORDS = {
    "the high end": "Large values of the map are",
    "the low end": "Small values of the map are",
    "white": "White in the map is",
    "black": "Black in the map is",
}
INVERT_TIP = "Swap near and far, for maps that count the other way round."
COLORS_TIP = "Depth over the picture as colours (D): the lighter, the nearer."
OPEN_TIP = "Open a depth map for this photo: PFM, EXR, NPY or 16-bit PNG."
SAVE_TIP = "Save depth with all edits. A map beside the photo is found again the next time."
RESET_TIP = "Remove all edits of depth."
OTHER_MODELS = "Depth models…", "All depth models, and model files of your own."
ESTIMATES_TIP = "Estimate the depth of photos without depth with the model that was chosen last, once it is here."


def depth_source(state: AppState, scene: Scene) -> str:
    """Return the source of depth in a few words."""
    return "being looked for" if scene.depth_source == "none" and state.is_making_views else scene.depth_source


def depth_line(state: AppState, scene: Scene) -> None:
    """Build two lines about the source of depth, with a tooltip about failures."""
    origin = scene.depth_origin
    without = depth_source(state, scene)
    words = origin.line if origin is not None else "No depth." if without == "none" else f"Depth: {without}."
    tips = () if origin is None else (*origin.failures, BETTER_DEPTH) if origin.is_poor else origin.failures
    lines(words, ORIGIN_LINES, imgui.get_content_region_avail().x, "\n".join(tips))


def depth_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section. Edits are previewed until they end, and then cost a new light field."""
    if scene.plan is None:
        quiet("The depth of a light field cannot be edited.")
        return []
    _notes(state, scene)
    actions = _source(state)
    refines = checkbox("Refine edges", state.depth.refine, REFINE_TIP)
    actions += edit(depth.set_refine, state.depth.refine, refines)
    gap()
    actions += depth_histogram(state, scene) + _tone(state)
    for rows in (brush_rows, selection_rows, _files):
        gap()
        actions += rows(state)
    return actions


def _notes(state: AppState, scene: Scene) -> None:
    """Build notes about poor depth, failures, and the end of the map that is near."""
    origin = scene.depth_origin
    if origin is None:
        return
    if origin.is_poor:
        quiet(BETTER_DEPTH)
    for failure in origin.failures:
        imgui.bullet()
        quiet(failure)
    if origin.near:
        far = next(other for pair in ENDS for end, other in (pair, pair[::-1]) if end == origin.near)
        quiet(f"{END_WORDS[far if state.depth.edits.is_inverted else origin.near]} near.")
        tooltip(NEAR_END_TIP)


def _source(state: AppState) -> list[Action]:
    """Build the choice of a source, with the models on this computer, the chosen one first."""
    source = state.source
    if source is None:
        return []
    model, ready = source.depth.model, [model.name for model in state.models.known if model.is_ready]
    models = list(dict.fromkeys([model, *ready] if model else ready))
    starts: list[tuple[DepthStart, str | None]] = [("auto", None), ("embedded", None)]
    starts += [("model", name) for name in models] + [("rough", None), ("flat", None)]
    label("From", SOURCE_TIP)
    entries = [(_source_text(start, name), START_TIPS[start]) for start, name in starts] + [OTHER_MODELS]
    shown = last_part(source.depth.file) if source.depth.file else _source_text(source.depth.start, model)
    picked = combo("depth from", shown, entries, SOURCE_TIP)
    if picked is None:
        return []
    if picked == len(starts):
        return [do(depth_models.show_models)]
    start, model = starts[picked]
    if model is not None:
        return [do(depth_models.use_model, model)]
    return [do(opening.open_source, source_with_depth(source, start))]


def _source_text(start: DepthStart, model: str | None) -> str:
    return last_part(model) if start == "model" and model else START_WORDS[start]


def _tone(state: AppState) -> list[Action]:
    edits, overlay = state.depth.edits, state.inspection.overlay
    far = slider("Far clip", edits.far_clip, (0.0, 1.0), "%.2f" if edits.far_clip > 0 else "off", FAR_TIP)
    has_ended = imgui.is_item_deactivated_after_edit()
    near = slider("Near clip", edits.near_clip, (0.0, 1.0), "%.2f" if edits.near_clip < 1 else "off", NEAR_TIP)
    has_ended |= imgui.is_item_deactivated_after_edit()
    gamma = slider("Gamma", edits.gamma, GAMMA_LIMITS, "%.2f", GAMMA_TIP, is_logarithmic=True)
    has_ended |= imgui.is_item_deactivated_after_edit()
    is_inverted = checkbox("Invert", edits.is_inverted, INVERT_TIP)
    has_ended |= is_inverted != edits.is_inverted
    edited = replace(edits, far_clip=far, near_clip=near, gamma=gamma, is_inverted=is_inverted)
    actions = [do(depth.set_tone, edited, has_ended)] if edited != edits or has_ended else []
    imgui.same_line()
    is_shown = overlay == "disparity"
    if checkbox("Show as colours", is_shown, COLORS_TIP) != is_shown:
        actions.append(do(inspection.set_overlay, None if is_shown else "disparity"))
    return actions


def _files(state: AppState) -> list[Action]:
    actions: list[Action] = []
    if button("Open map…", OPEN_TIP):
        actions.append(do(ask, ChooseTask("map")))
    imgui.same_line(0, SPACING * scale())
    if button("Save map…", SAVE_TIP):
        actions.append(do(saving.ask_to_save, "map"))
    imgui.same_line(0, SPACING * scale())
    if button("Reset", RESET_TIP, state.depth.edits != UNEDITED):
        actions.append(do(depth.reset))
    guesses = state.preferences.guesses_depth
    estimates = checkbox("Estimate depth of new photos", not guesses, ESTIMATES_TIP)
    return actions + edit(preferences.guess_depth_always, guesses, not estimates)
