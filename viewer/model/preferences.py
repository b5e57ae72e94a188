"""Verbs about preferences, which outlast the program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, get_args

from iibr_core.exports.photo_folder import FolderOrder
from viewer.model.action import Setter, setter
from viewer.model.stereo import Monitor, StereoMode

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


Theme = Literal["dark", "light"]
Units = Literal["photographic", "light field"]
"""Units of distances and apertures: near to far and f-numbers, or pixels per view step and view steps."""

Section = Literal[
    "more", "view", "focus", "aperture", "light", "gloss", "depth", "stereo display", "advanced", "inspect", "scene"
]
SECTIONS: tuple[Section, ...] = get_args(Section)
"""Sections of the panel, from top to bottom."""
PARENT_SECTION: dict[Section, Section] = {
    **dict.fromkeys(SECTIONS[1:9], "more"),
    "inspect": "advanced",
    "scene": "advanced",
}
"""Section that holds each section: it is seen only while that one is open, too."""


def is_seen_open(section: Section, open_sections: tuple[Section, ...]) -> bool:
    """Return whether a section is open, and every section that holds it."""
    return all(each in open_sections for each in _with_parents(section))


def with_sections(open_sections: tuple[Section, ...], *wanted: Section) -> tuple[Section, ...]:
    """Return the open sections with these and all that hold them, from top to bottom."""
    opened = {*open_sections, *(each for section in wanted for each in _with_parents(section))}
    return tuple(section for section in SECTIONS if section in opened)


def _with_parents(section: Section) -> tuple[Section, ...]:
    parent = PARENT_SECTION.get(section)
    return (section,) if parent is None else (section, *_with_parents(parent))


@dataclass(frozen=True)
class Preferences:
    """Preferences, which outlast the program.

    window: x, y, width, height in screen units, None before the first one; is_maximized: whether it filled the screen.
    last_folder: of the last saved or exported file, "" before the first; opened_folder: of the last opened photo.
    depth_model: name or path of the model that was chosen for all photos, "" for any that is here. guesses_depth:
    whether photos without depth keep a guess although a model is here. offers_models: whether the first guess of a run
    comes with the offer of a model. tracker: address of the tracker of the head. head_range_cm: movement of the head
    from the middle to the outermost views. stereo_monitor: chosen last; None for any.
    """

    theme: Theme = "dark"
    font_scale: float = 1.0
    open_sections: tuple[Section, ...] = ()
    window: tuple[int, int, int, int] | None = None
    is_maximized: bool = False
    shows_filmstrip: bool = False
    folder_order: FolderOrder = "name"
    units: Units = "photographic"
    depth_model: str = ""
    guesses_depth: bool = False
    offers_models: bool = True
    last_folder: str = ""
    opened_folder: str = ""
    tracker: str = "udp:127.0.0.1:4242"
    head_range_cm: float = 15.0
    stereo_mode: StereoMode = "half-sbs"
    swaps_eyes: bool = False
    stereo_monitor: Monitor | None = None


FONT_SCALE_LIMITS = 0.6, 2.5
set_theme: Setter[Theme] = setter("preferences.theme")
set_font_scale: Setter[float] = setter("preferences.font_scale", FONT_SCALE_LIMITS)
"""Set the factor of text and widgets."""
set_units: Setter[Units] = setter("preferences.units")
show_filmstrip: Setter[bool] = setter("preferences.shows_filmstrip")
guess_depth_always: Setter[bool] = setter("preferences.guesses_depth")
"""Decide whether photos without depth keep a guess although a model is here."""


def toggle_section(state: AppState, section: Section) -> AppState:
    """Close a section that is seen open; otherwise open it, with those that hold it."""
    sections = state.preferences.open_sections
    if is_seen_open(section, sections):
        sections = tuple(other for other in sections if other != section)
    else:
        sections = with_sections(sections, section)
    return replace(state, preferences=replace(state.preferences, open_sections=sections))


def place_window(state: AppState, place: tuple[int, int, int, int] | None) -> AppState:
    """Remember the window's x, y, width and height in screen units; None if it fills the screen."""
    placed = replace(state.preferences, window=place or state.preferences.window, is_maximized=place is None)
    return replace(state, preferences=placed)
