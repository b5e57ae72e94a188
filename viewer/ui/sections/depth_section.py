"""The panel's section for depth: where it came from, how much of it, what was done to it, and the brush."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.choice import DepthStart
from iibr_core.depth.editing.edits import BRUSH_TOOLS, DEPTH_TOOLS, GAMMA_LIMITS, RADIUS_LIMITS, BrushTool, DepthEdits
from iibr_core.scenes.scene import Scene, source_with_depth
from viewer.model import depth, depth_models, inspection, messages, opening, preferences, saving
from viewer.model.action import Action, ask, do
from viewer.model.commands import BRUSH_WORDS
from viewer.model.layout import Layout
from viewer.model.remedies import BETTER_DEPTH
from viewer.model.state.app_state import AppState
from viewer.model.state.depth import Brush
from viewer.model.state.depth_models import DepthModels, ModelsPrompt
from viewer.model.state.tasks import ChooseTask
from viewer.ui.sections.depth_histogram import depth_histogram
from viewer.ui.widgets import (
    button,
    checkbox,
    choice,
    combo,
    gap,
    in_row,
    label,
    last_part,
    percent_slider,
    quiet,
    slider,
    tooltip,
)

START_WORDS: dict[DepthStart, str] = {
    "auto": "Automatic",
    "embedded": "The photo's own",
    "model": "A depth model",
    "rough": "A rough guess",
    "flat": "None: flat",
}
START_TIPS: dict[DepthStart, str] = {
    "auto": "A map beside the photo, else depth in the photo's file, else a depth model, else a guess.",
    "embedded": "What the camera stored in the file, as phones do with portraits.",
    "model": "A model on this machine estimates it from the picture.",
    "rough": "From height in the picture and outlines: the picture moves, but near and far may be wrong.",
    "flat": "Everything is equally far away, so nothing moves.",
}
FROM_TIP = "Where depth comes from. Another choice opens the photo again."
REFINE_TIP = "Draws depth to the photo's edges: crisper outlines. Exact maps stay as they are."
FAR_TIP = "All that is farther comes as near as this. The left handle above does the same."
NEAR_TIP = "All that is nearer goes as far as this. The right handle above does the same."
GAMMA_TIP = "Above 1, near things stand out more; below 1, far ones do."
NEAR_END_TIP = "Which end of the map's values counts as near. Invert, below, turns it."
INVERT_TIP = "Swaps near and far: for maps that count the other way round."
BRUSH_TIPS: dict[BrushTool, str] = {
    "nearer": "Drag over the picture to bring it nearer; strokes end at the photo's edges (B puts the brush away).",
    "farther": "Drag over the picture to push it away; strokes end at the photo's edges (B puts the brush away).",
    "smooth": "Drag over the picture to smooth its depth, along the photo's edges (B puts the brush away).",
    "level": "Drag over the picture to give it one depth, up to the photo's edges (B puts the brush away).",
    "fill": "Click a surface to give it one depth, up to edges of the photo and of depth (B puts the bucket away).",
}
STROKE_TIP = "How much one stroke changes. Level and Bucket always give the whole depth."
SAMPLE_TIP = (
    "Level and Bucket give the depth of where you press. Ctrl+click picks the depth of another place; this forgets it."
)
OTHER_MODELS = "Depth models…", "All that can be had, and a file of your own."
ESTIMATES_TIP = "Photos without depth get it from the recommended model. Until that is done, it is guessed."
TOOLS_A_ROW = 3


def depth_line(scene: Scene, layout: Layout) -> None:
    """Where depth came from, in one line, and what failed."""
    origin = scene.depth_origin
    quiet(origin.line if origin is not None else f"Depth: {scene.depth_source}.")
    if origin is not None:
        tooltip("\n".join((*origin.failures, BETTER_DEPTH) if origin.is_poor else origin.failures), layout)


def depth_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section. Edits tell when they end, because they cost a new light field; before they are previewed."""
    if scene.plan is None:
        quiet("The depth of a light field cannot be changed: its views hold it.")
        return []
    actions = _origin(state, scene, layout)
    actions += _refine(state, layout)
    gap(layout, 2)
    actions += depth_histogram(state, scene, layout)
    actions += _tone(state, layout)
    gap(layout, 2)
    actions += _brush(state, layout)
    gap(layout, 2)
    return actions + _files(state, layout) + _estimates_new(state, layout)


def _origin(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Which source of depth is asked for, with the models that are here; advice where it is poor."""
    origin = scene.depth_origin
    if origin is not None and origin.is_poor:
        quiet(BETTER_DEPTH)
    for failure in origin.failures if origin is not None else ():
        imgui.bullet()
        quiet(failure)
    if origin is not None and origin.near:
        end = origin.near if not state.depth.edits.is_inverted else "the other end"
        quiet(f"Near in the map: {end}.")
        tooltip(NEAR_END_TIP, layout)
    source = state.source
    if source is None:
        return []
    wanted = _choice_text(source.depth.start, source.depth.model, source.depth.file)
    ways: list[tuple[DepthStart, str | None]] = [("auto", None), ("embedded", None)]
    names = _models(state.models, source.depth.model)
    ways += [("model", name) for name in names] + [("rough", None), ("flat", None)]
    label("From", layout, FROM_TIP)
    entries = [(_choice_text(start, model, None), START_TIPS[start]) for start, model in ways] + [OTHER_MODELS]
    picked = combo("depth from", wanted, entries, layout, FROM_TIP)
    actions: list[Action] = []
    if picked == len(ways):
        actions.append(do(messages.show_prompt, ModelsPrompt()))
    elif picked is not None:
        start, model = ways[picked]
        actions.append(
            do(depth_models.use_model, model)
            if model is not None
            else do(opening.open_source, source_with_depth(source, start))
        )
    return actions


def _estimates_new(state: AppState, layout: Layout) -> list[Action]:
    estimates = checkbox("Estimate depth of new photos", state.preferences.estimates_depth, layout, ESTIMATES_TIP)
    return [] if estimates is None else [do(preferences.estimate_depth_always, estimates)]


def _models(models: DepthModels, chosen: str | None) -> list[str]:
    here = [model.name for model in models.known if model.is_ready]
    return list(dict.fromkeys([*([chosen] if chosen else []), *here]))


def _choice_text(start: DepthStart, model: str | None, path: str | None) -> str:
    if path is not None:
        return last_part(path)
    return last_part(model) if start == "model" and model else START_WORDS[start]


def _refine(state: AppState, layout: Layout) -> list[Action]:
    refines = checkbox("Refine edges", state.depth.refine, layout, REFINE_TIP)
    return [] if refines is None else [do(depth.set_refine, refines)]


def _tone(state: AppState, layout: Layout) -> list[Action]:
    edits = state.depth.edits
    actions: list[Action] = []

    def edit(value: float | None, name: str) -> None:
        is_finished = imgui.is_item_deactivated_after_edit()
        if value is not None or is_finished:
            changed: DepthEdits = edits if value is None else replace(edits, **{name: value})  # type: ignore[arg-type]
            actions.append(do(depth.set_tone, changed, is_finished))

    far_form = "off" if edits.far_clip == 0 else "%.2f"
    edit(slider("Far clip", edits.far_clip, (0.0, 1.0), far_form, layout, FAR_TIP), "far_clip")
    near_form = "off" if edits.near_clip == 1 else "%.2f"
    edit(slider("Near clip", edits.near_clip, (0.0, 1.0), near_form, layout, NEAR_TIP), "near_clip")
    edit(slider("Gamma", edits.gamma, GAMMA_LIMITS, "%.2f", layout, GAMMA_TIP, is_logarithmic=True), "gamma")
    inverted = checkbox("Invert", edits.is_inverted, layout, INVERT_TIP)
    if inverted is not None:
        actions.append(do(depth.set_tone, replace(edits, is_inverted=inverted), is_finished=True))
    imgui.same_line()
    shows = state.inspection.overlay == "disparity"
    shown = checkbox("Show as colours", shows, layout, "Depth over the picture: the lighter, the nearer (D).")
    if shown is not None:
        actions.append(do(inspection.set_overlay, "disparity" if shown else None))
    return actions


def _brush(state: AppState, layout: Layout) -> list[Action]:
    """A button each tool; the one in hand is lit, and pressing it again puts the brush away."""
    brush = state.brush
    actions: list[Action] = []
    imgui.text("Brush")
    for tool, width in in_row(BRUSH_TOOLS, layout, TOOLS_A_ROW):
        is_in_hand = brush.is_on and brush.tool == tool
        if choice(BRUSH_WORDS[tool], is_in_hand, layout, (width, 0), BRUSH_TIPS[tool]):
            actions.append(do(depth.set_brush, replace(brush, tool=tool, is_on=not is_in_hand)))
    limits = (100 * RADIUS_LIMITS[0], 100 * RADIUS_LIMITS[1])
    tip = "How wide it paints, as a share of the photo's width (wheel over the picture)."
    size = slider("Size", 100 * brush.radius, limits, "%.1f %%", layout, tip, True, brush.is_on)
    actions += [] if size is None else [do(depth.set_brush, replace(brush, radius=size / 100))]
    actions += _strength(brush, layout) + _sample(brush, layout)
    _scroll_here_when_taken(brush.is_on)
    return actions


def _scroll_here_when_taken(is_in_hand: bool) -> None:
    """Taken by its key the brush may be out of sight."""
    before, key = imgui.get_state_storage(), imgui.get_id("brush in hand")
    if is_in_hand and not before.get_bool(key) and not imgui.is_item_visible():
        imgui.set_scroll_here_y(1.0)
    before.set_bool(key, is_in_hand)


def _strength(brush: Brush, layout: Layout) -> list[Action]:
    is_used = brush.is_on and brush.tool not in DEPTH_TOOLS
    strength = percent_slider("Strength", brush.strength, layout, STROKE_TIP, is_used)
    return [] if strength is None else [do(depth.set_brush, replace(brush, strength=strength))]


def _sample(brush: Brush, layout: Layout) -> list[Action]:
    """Level and bucket give the depth where one presses, or that of the place that was picked."""
    is_picked = brush.is_on and brush.tool in DEPTH_TOOLS and brush.sample is not None
    is_dropped = button("Forget the picked depth", layout, SAMPLE_TIP, is_picked)
    return [do(depth.set_brush, replace(brush, sample=None))] if is_dropped else []


def _files(state: AppState, layout: Layout) -> list[Action]:
    actions: list[Action] = []
    if button("Open map…", layout, "A depth map for this photo: PFM, EXR, NPY or 16-bit PNG."):
        actions.append(do(ask, ChooseTask("map")))
    imgui.same_line(0, 4 * layout.ui_scale)
    if button("Save map…", layout, "Depth with all your edits. Beside the photo it is found again the next time."):
        actions.append(do(saving.ask_to_save, "map"))
    imgui.same_line(0, 4 * layout.ui_scale)
    is_edited = state.source is not None and state.depth.edits != DepthEdits()
    if button("Reset", layout, "Depth as it was found, without your edits.", is_edited):
        actions.append(do(depth.reset))
    return actions
