"""The list of depth models: figures, size and licence of each, to download and use them."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from viewer.model import depth_models, messages
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.depth_models import ModelOffer, ModelsPrompt
from viewer.model.tasks import ChooseTask, ask
from viewer.ui.overlays.prompt_rows import button_rows
from viewer.ui.widgets import gap, quiet

MAX_LIST_SHARE = 0.55
"""Largest height of the list as a share of the window; longer lists scroll."""


def models_prompt(prompt: ModelsPrompt, state: AppState) -> list[Action]:
    """Build a row for each model, and buttons for the selected model."""
    models, usual = state.models.known, depth_models.usual_model(state)
    if usual is not None and models and all(model.name != usual for model in models):
        models += (depth_models.model_named(state.models, usual),)
    imgui.text("Depth models")
    gap()
    if not models:
        quiet("Looking for models…")
    models = tuple(sorted(models, key=lambda model: not model.is_here))
    places = {model.name: i for i, model in enumerate(models)}
    usual = usual or next((model.name for model in models if model.is_recommended), "")
    selected = places.get(usual, 0) if prompt.selected is None else prompt.selected
    pressed = _rows(models, selected, state.preferences.depth_model)
    gap()
    close = do(messages.show_prompt, None)
    taken = button_rows([*_buttons(state, models[selected] if models else None), ("Cancel", close)])
    if taken:
        return [close, *taken]
    return [] if pressed is None else [do(messages.show_prompt, replace(prompt, selected=pressed))]


def _buttons(state: AppState, model: ModelOffer | None) -> list[tuple[str, Action]]:
    """Return the word of each button and its action; without an open photo there are none."""
    if state.source is None or state.scene is None or state.scene.plan is None:
        return []
    buttons: list[tuple[str, Action]] = []
    if model is not None and not (model.is_here and model.lacks):
        word = "Use this model" if model.is_here else f"Download ({model.megabytes:,} MB)"
        buttons.append((word, do(depth_models.use_model, model.name)))
    buttons.append(("Choose a file…", do(ask, ChooseTask("model"))))
    if state.has_dialogs:  # a path that is typed may be either
        buttons.append(("Choose a folder…", do(ask, ChooseTask("model folder"))))
    return buttons


def _rows(models: tuple[ModelOffer, ...], selected: int, chosen: str) -> int | None:
    """Build the rows and return the index of the row that was pressed. chosen: name of the model for all photos."""
    style, pressed = imgui.get_style(), None
    width = imgui.get_content_region_avail().x - style.scrollbar_size - style.item_spacing.x
    line, padding = imgui.get_text_line_height(), style.item_inner_spacing.y
    heights = [line + imgui.calc_text_size(model.words, False, width).y + 2 * padding for model in models]
    height = min(sum(heights) + style.item_spacing.y * len(models), MAX_LIST_SHARE * imgui.get_io().display_size.y)
    imgui.begin_child("models", imgui.ImVec2(0, max(height, 1)))
    for i, (model, row) in enumerate(zip(models, heights)):
        start = imgui.get_cursor_pos()
        if imgui.selectable(f"##{model.name}", i == selected, 0, imgui.ImVec2(0, row))[0]:
            pressed = i
        end = imgui.get_cursor_pos()
        imgui.set_cursor_pos(imgui.ImVec2(start.x + padding, start.y + padding))
        where = "used for all photos" if model.name == chosen else "here" if model.is_here else ""
        imgui.text(f"{model.title} ({where})" if where else model.title)
        imgui.set_cursor_pos(imgui.ImVec2(start.x + padding, start.y + padding + line))
        imgui.push_text_wrap_pos(start.x + width)
        (imgui.text_wrapped if i == selected else quiet)(model.words)  # quiet words fade on the selected row's colour
        imgui.pop_text_wrap_pos()
        imgui.set_cursor_pos(end)
    imgui.dummy(imgui.ImVec2(0, 0))
    imgui.end_child()
    return pressed
