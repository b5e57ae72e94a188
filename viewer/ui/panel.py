"""The panel at the right: what is open, how it is looked at, how far the work is, what the plan chose, and the keys."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from viewer.actions import (
    DEPTH_STRENGTH_LIMIT,
    EXPOSURE_LIMIT_STOPS,
    Action,
    SetAperture,
    SetDepthStrength,
    SetExposure,
    SetFocus,
    aperture_limit,
    focus_limits,
)
from viewer.layout import Layout
from viewer.state import AppState, Progress, Scene
from viewer.ui.style import QUIET_TEXT

LABEL_WIDTH = 104.0
NO_DEPTH = "none"
HELP = (
    ("Drag, arrows", "move the viewpoint"),
    ("Click", "focus there"),
    ("Wheel", "change the focus"),
    ("R, double-click", "reset"),
    ("Drop a file", "open it"),
    ("Esc", "quit"),
)
_FIXED = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_collapse
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_nav
)


def panel(state: AppState, layout: Layout) -> list[Action]:
    """Build the panel; what the user changed comes back as actions."""
    rect = layout.panel
    imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
    imgui.set_next_window_size(imgui.ImVec2(rect.width, rect.height))
    imgui.begin("panel", None, _FIXED)
    actions: list[Action] = []
    if state.scene is None:
        imgui.text_wrapped("Drop a photo or a light-field folder on this window to open it.")
    else:
        _scene_lines(state.scene)
        _gap(layout)
        actions += _sliders(state, state.scene, layout)
    _gap(layout)
    _progress(state.progress, layout)
    if state.scene and state.scene.plan:
        _heading("Scene plan", layout)
        for reason in state.scene.plan.reasons:
            _quiet(reason)
    _help(layout)
    imgui.end()
    return actions


def progress_words(progress: Progress) -> str:
    """The progress in one line, "23 of 81 views, 1.2 s"; empty where nothing was asked for."""
    if progress.total:
        return f"{progress.done} of {counted_views(progress.total)}, {progress.seconds:.1f} s"
    return progress.doing


def counted_views(number: int) -> str:
    """A number of views in words: "1 view", "81 views"."""
    return f"{number} view" if number == 1 else f"{number} views"


def size_words(scene: Scene) -> str:
    """Size, views, and how they are made where that is not the plain way: "600 × 400 px, 9 × 9 views, exact"."""
    words = f"{scene.width} × {scene.height} px, {scene.grid.rows} × {scene.grid.columns} views"
    is_made_here = scene.plan is not None
    return words if scene.source.quality == "fast" or not is_made_here else f"{words}, {scene.source.quality}"


def _scene_lines(scene: Scene) -> None:
    imgui.text_wrapped(scene.name)
    _quiet(size_words(scene))
    _quiet(f"Depth: {scene.depth_source}")


def _sliders(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """One row a quantity. Depth strength tells when the edit ends, because it costs a new light field."""
    optics = state.optics
    actions: list[Action] = []

    def add(label: str, value: float, low: float, high: float, form: str, action: Callable[[float], Action]) -> None:
        changed, new = _slider(label, value, low, high, form, layout)
        if changed:
            actions.append(action(new))

    if widest := aperture_limit(scene.grid):
        add("Focus", optics.focus_disparity, *focus_limits(scene), "%.2f px", SetFocus)
        add("Aperture", optics.aperture_diameter, 0.0, widest, "%.1f views", SetAperture)
    add("Exposure", optics.exposure_stops, -EXPOSURE_LIMIT_STOPS, EXPOSURE_LIMIT_STOPS, "%+.1f stops", SetExposure)
    if scene.plan and scene.depth_source != NO_DEPTH:
        changed, strength = _slider("Depth", state.depth_strength, 0.0, DEPTH_STRENGTH_LIMIT, "× %.2f", layout)
        is_finished = imgui.is_item_deactivated_after_edit()
        if changed or is_finished:
            actions.append(SetDepthStrength(strength, is_finished))
    return actions


def _slider(label: str, value: float, low: float, high: float, form: str, layout: Layout) -> tuple[bool, float]:
    imgui.align_text_to_frame_padding()
    imgui.text(label)
    imgui.same_line(LABEL_WIDTH * layout.ui_scale)
    imgui.set_next_item_width(-1)
    return imgui.slider_float(f"##{label}", value, low, high, form, imgui.SliderFlags_.always_clamp)


def _progress(progress: Progress, layout: Layout) -> None:
    """A bar that stays when the work is done, so that nothing below it jumps."""
    words = progress_words(progress)
    if not words:
        return
    fraction = progress.done / progress.total if progress.total else 0.0
    imgui.progress_bar(fraction, imgui.ImVec2(-1, 4 * layout.ui_scale), "")
    _quiet(words)


def _help(layout: Layout) -> None:
    _heading("Mouse and keys", layout)
    for keys, meaning in HELP:
        _quiet(keys)
        imgui.same_line(LABEL_WIDTH * layout.ui_scale + imgui.get_style().window_padding.x)
        imgui.text(meaning)


def _heading(text: str, layout: Layout) -> None:
    _gap(layout)
    imgui.separator()
    imgui.text(text)


def _quiet(text: str) -> None:
    imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*QUIET_TEXT))
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def _gap(layout: Layout) -> None:
    imgui.dummy(imgui.ImVec2(0, 4 * layout.ui_scale))
