"""The panel's section for depth: source, tone and files. `depth_brush` has the rows of the brush."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.choice import DepthStart
from iibr_core.depth.editing.edits import GAMMA_LIMITS, UNEDITED, DepthEdits
from iibr_core.scenes.scene import Scene, source_with_depth
from viewer.model import depth, depth_models, inspection, messages, opening, preferences, saving
from viewer.model.action import Action, ask, do
from viewer.model.layout import Layout
from viewer.model.remedies import BETTER_DEPTH
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import DepthModels, ModelsPrompt
from viewer.model.state.tasks import ChooseTask
from viewer.ui.sections.depth_brush import brush_rows, selection_rows
from viewer.ui.sections.depth_histogram import depth_histogram
from viewer.ui.widgets import button, checkbox, combo, gap, label, last_part, quiet, slider, tooltip

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
INVERT_TIP = "Swap near and far, for maps that count the other way round."
COLORS_TIP = "Depth over the picture as colours (D): the lighter, the nearer."
OPEN_TIP = "Open a depth map for this photo: PFM, EXR, NPY or 16-bit PNG."
SAVE_TIP = "Save depth with all edits. A map beside the photo is found again the next time."
RESET_TIP = "Remove all edits of depth."
OTHER_MODELS = "Depth models…", "All depth models, and model files of your own."
ESTIMATES_TIP = "Estimate depth of photos without depth with the recommended model. Until then, it is guessed."


def depth_line(scene: Scene, layout: Layout) -> None:
    """Build one line about the source of depth, with a tooltip about failures."""
    origin = scene.depth_origin
    quiet(origin.line if origin is not None else f"Depth: {scene.depth_source}.")
    if origin is not None:
        tooltip("\n".join((*origin.failures, BETTER_DEPTH) if origin.is_poor else origin.failures), layout)


def depth_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section. Edits are previewed until they end, and then cost a new light field."""
    if scene.plan is None:
        quiet("The depth of a light field cannot be edited.")
        return []
    _notes(state, scene, layout)
    actions = _source(state, layout)
    refines = checkbox("Refine edges", state.depth.refine, layout, REFINE_TIP)
    actions += [] if refines is None else [do(depth.set_refine, refines)]
    gap(layout, 2)
    actions += depth_histogram(state, scene, layout) + _tone(state, layout)
    gap(layout, 2)
    actions += brush_rows(state, layout)
    gap(layout, 2)
    actions += selection_rows(state, layout)
    gap(layout, 2)
    return actions + _files(state, layout)


def _notes(state: AppState, scene: Scene, layout: Layout) -> None:
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
        end = origin.near if not state.depth.edits.is_inverted else "the other end"
        quiet(f"Near in the map: {end}.")
        tooltip(NEAR_END_TIP, layout)


def _source(state: AppState, layout: Layout) -> list[Action]:
    """Build the choice of a source, with the models on this computer."""
    source = state.source
    if source is None:
        return []
    starts: list[tuple[DepthStart, str | None]] = [("auto", None), ("embedded", None)]
    starts += [("model", name) for name in _models(state.models, source.depth.model)]
    starts += [("rough", None), ("flat", None)]
    label("From", layout, SOURCE_TIP)
    entries = [(_source_text(start, model, None), START_TIPS[start]) for start, model in starts] + [OTHER_MODELS]
    shown = _source_text(source.depth.start, source.depth.model, source.depth.file)
    picked = combo("depth from", shown, entries, layout, SOURCE_TIP)
    if picked is None:
        return []
    if picked == len(starts):
        return [do(messages.show_prompt, ModelsPrompt())]
    start, model = starts[picked]
    return [
        do(depth_models.use_model, model)
        if model is not None
        else do(opening.open_source, source_with_depth(source, start))
    ]


def _models(models: DepthModels, chosen: str | None) -> list[str]:
    """Return the names of models that can be chosen, the chosen model first."""
    here = [model.name for model in models.known if model.is_ready]
    return list(dict.fromkeys([*([chosen] if chosen else []), *here]))


def _source_text(start: DepthStart, model: str | None, path: str | None) -> str:
    if path is not None:
        return last_part(path)
    return last_part(model) if start == "model" and model else START_WORDS[start]


def _tone(state: AppState, layout: Layout) -> list[Action]:
    edits = state.depth.edits
    actions: list[Action] = []

    def take(changed: DepthEdits | None) -> None:
        """Add the edit of the last slider; None: its value did not change."""
        is_finished = imgui.is_item_deactivated_after_edit()
        if changed is not None or is_finished:
            actions.append(do(depth.set_tone, changed or edits, is_finished))

    far = slider("Far clip", edits.far_clip, (0.0, 1.0), "%.2f" if edits.far_clip > 0 else "off", layout, FAR_TIP)
    take(None if far is None else replace(edits, far_clip=far))
    near = slider("Near clip", edits.near_clip, (0.0, 1.0), "%.2f" if edits.near_clip < 1 else "off", layout, NEAR_TIP)
    take(None if near is None else replace(edits, near_clip=near))
    gamma = slider("Gamma", edits.gamma, GAMMA_LIMITS, "%.2f", layout, GAMMA_TIP, is_logarithmic=True)
    take(None if gamma is None else replace(edits, gamma=gamma))
    inverted = checkbox("Invert", edits.is_inverted, layout, INVERT_TIP)
    if inverted is not None:
        actions.append(do(depth.set_tone, replace(edits, is_inverted=inverted), is_finished=True))
    imgui.same_line()
    shown = checkbox("Show as colours", state.inspection.overlay == "disparity", layout, COLORS_TIP)
    if shown is not None:
        actions.append(do(inspection.set_overlay, "disparity" if shown else None))
    return actions


def _files(state: AppState, layout: Layout) -> list[Action]:
    actions: list[Action] = []
    spacing = 4 * layout.ui_scale
    if button("Open map…", layout, OPEN_TIP):
        actions.append(do(ask, ChooseTask("map")))
    imgui.same_line(0, spacing)
    if button("Save map…", layout, SAVE_TIP):
        actions.append(do(saving.ask_to_save, "map"))
    imgui.same_line(0, spacing)
    if button("Reset", layout, RESET_TIP, state.depth.edits != UNEDITED):
        actions.append(do(depth.reset))
    estimates = checkbox("Estimate depth of new photos", state.preferences.estimates_depth, layout, ESTIMATES_TIP)
    return actions if estimates is None else [*actions, do(preferences.estimate_depth_always, estimates)]
