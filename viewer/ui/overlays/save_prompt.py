"""The prompt to save the picture or its depth map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import TypeVar

from imgui_bundle import imgui

from iibr_core.formats.images.picture_kinds import BEST_QUALITY, KINDS, PROFILES
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB
from viewer.model.action import Action
from viewer.model.app_state import AppState
from viewer.model.saving import SavePrompt
from viewer.ui.overlays.prompt_rows import place_actions, place_row, size_row
from viewer.ui.widgets import gap, label, quiet, slider

Option = TypeVar("Option")
PICTURE_ENDINGS = "The ending of the name sets the format: png, jpg, tif, webp, avif or exr (HDR)."
MAP_ENDINGS = "The ending of the name sets the format: pfm, exr, npy, tif or png (16 bits, scaled)."


def save_prompt(prompt: SavePrompt, state: AppState) -> list[Action]:
    """Draw the prompt; return the actions of the user."""
    is_map = prompt.what == "map"
    imgui.text("Save the depth map" if is_map else "Save the picture")
    gap()
    row, edited = place_row("File", prompt.path, state, prompt.problem), prompt
    if not is_map and state.scene is not None:
        edited = _form_rows(_with_size(prompt, state.scene), state.scene)
    quiet(MAP_ENDINGS if is_map else PICTURE_ENDINGS)
    return place_actions(prompt, edited, row, "Save", state)


def _with_size(prompt: SavePrompt, scene: Scene) -> SavePrompt:
    """Draw width and height; the picture keeps its shape."""
    width = size_row(prompt.size_px)
    if width is None:
        return prompt
    return replace(prompt, size_px=ScreenSize(width, max(round(width * scene.height / scene.width), 1)))


def _form_rows(prompt: SavePrompt, scene: Scene) -> SavePrompt:
    """Draw the options of the typed format."""
    kind, form = KINDS.get(PurePath(prompt.path).suffix.lower()), prompt.form
    if kind is None:
        return prompt
    if form.bits not in kind.bits:
        form = replace(form, bits=None)  # of another format, typed before
    if kind.has_quality:
        tip = "Lower quality makes a smaller file with less detail."
        form = replace(form, quality=round(slider("Quality", form.quality, (1, BEST_QUALITY), "%.0f", tip)))
    if len(kind.bits) > 1:
        label("Bits", "Bits per colour channel. 16 keep smooth skies smooth in later edits.")
        usual = form.bits or kind.bits[0]
        chosen = _radio({str(bits): bits for bits in sorted(kind.bits)}, usual)
        form = form if chosen == usual else replace(form, bits=chosen)
    if scene.color_space != SRGB or form.color_space is not None:
        label("Colours", "Display P3 keeps more of this photo's colours; every program shows sRGB.")
        space = form.space_for(scene.color_space)
        chosen_space = _radio({profile.name: profile for profile in PROFILES.values()}, space)
        form = form if chosen_space == space else replace(form, color_space=chosen_space)
    label("Location", "The place where the photo was taken, if its file states it.")
    form = replace(form, keeps_position=imgui.checkbox("keep GPS data", form.keeps_position)[1])
    return prompt if form == prompt.form else replace(prompt, form=form)


def _radio(choices: Mapping[str, Option], chosen: Option) -> Option:
    """Draw choices side by side; return the chosen one."""
    for i, (words, choice) in enumerate(choices.items()):
        if i:
            imgui.same_line()
        if imgui.radio_button(words, choice == chosen):
            chosen = choice
    return chosen
