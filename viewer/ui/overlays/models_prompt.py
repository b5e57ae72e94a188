"""The list of depth models: what each is good for, its size and licence, what else it needs; one is got or used."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from viewer.model import messages
from viewer.model.action import ask, do
from viewer.model.actions import Action
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.model_download import GetDepth, GetModelTask, ModelOffer, ModelsPrompt, UseModel
from viewer.model.state.tasks import ChooseTask
from viewer.ui.overlays.prompt_rows import button_rows
from viewer.ui.widgets import gap, quiet

LIST_SHARE = 0.55
"""Of the window's height: longer lists scroll."""
CANCEL = do(messages.show_prompt, None)


def models_prompt(prompt: ModelsPrompt, state: AppState, layout: Layout) -> list[Action]:
    """Build it: a row each, and buttons for the one that is selected."""
    models = state.models.known
    imgui.text("Depth models")
    gap(layout, 2)
    if not models:
        quiet("Looking for models…")
    chosen = next((i for i, model in enumerate(models) if model.is_recommended), 0)
    chosen = chosen if prompt.selected is None else prompt.selected
    pressed = _rows(models, chosen, layout)
    gap(layout, 2)
    has_photo = state.source is not None and state.scene is not None and state.scene.plan is not None
    offers: list[tuple[str, Action]] = []
    if models and has_photo and not (models[chosen].is_here and models[chosen].lacks):
        offers.append((_word(models[chosen]), UseModel(models[chosen].name)))
    if has_photo:
        offers.append(("Choose a file…", do(ask, ChooseTask("model"))))
    if has_photo and state.has_dialogs:  # what is typed may be either
        offers.append(("Choose a folder…", do(ask, ChooseTask("model folder"))))
    taken = button_rows([*offers, ("Cancel", CANCEL)])
    if not taken:
        return [do(messages.show_prompt, replace(prompt, selected=pressed))] if pressed is not None else []
    return [CANCEL] if taken == [CANCEL] else [CANCEL, *_done(taken[0], models[chosen] if models else None)]


def _done(action: Action, model: ModelOffer | None) -> list[Action]:
    """What it takes to use a model: one that is not here is downloaded first."""
    if model is None or not isinstance(action, UseModel) or model.is_here:
        return [action]
    return [GetDepth()] if model.is_recommended else [action, do(ask, GetModelTask(model.name))]


def _word(model: ModelOffer) -> str:
    return "Use it" if model.is_here else f"Download {model.megabytes:,} MB"


def _rows(models: tuple[ModelOffer, ...], chosen: int, layout: Layout) -> int | None:
    """The index of the one that was pressed."""
    style, pressed = imgui.get_style(), None
    room = imgui.get_content_region_avail().x - style.scrollbar_size - style.item_spacing.x
    line, padding = imgui.get_text_line_height(), style.item_inner_spacing.y
    heights = [line + imgui.calc_text_size(model.words, False, room).y + 2 * padding for model in models]
    most = LIST_SHARE * layout.window.height
    height = min(sum(heights) + style.item_spacing.y * len(models), most)
    imgui.begin_child("models", imgui.ImVec2(0, max(height, 1)))
    for i, (model, row) in enumerate(zip(models, heights)):
        start = imgui.get_cursor_pos()
        if imgui.selectable(f"##{model.name}", i == chosen, 0, imgui.ImVec2(0, row))[0]:
            pressed = i
        end = imgui.get_cursor_pos()
        imgui.set_cursor_pos(imgui.ImVec2(start.x + padding, start.y + padding))
        tags = ", ".join(["recommended"] * model.is_recommended + ["here"] * model.is_here)
        imgui.text(f"{model.title} ({tags})" if tags else model.title)
        imgui.set_cursor_pos(imgui.ImVec2(start.x + padding, start.y + padding + line))
        imgui.push_text_wrap_pos(start.x + room)
        quiet(model.words)
        imgui.pop_text_wrap_pos()
        imgui.set_cursor_pos(end)
    imgui.dummy(imgui.ImVec2(0, 0))
    imgui.end_child()
    return pressed
