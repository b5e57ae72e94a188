"""Verbs about preferences, which outlast the program."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.action import Setter, setter
from viewer.model.state.app_state import AppState
from viewer.model.state.preferences import Section, Theme, Units, is_seen_open, with_sections

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
