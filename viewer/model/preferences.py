"""Verbs about preferences, which outlast the program."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.scenes.lens_limits import clamp
from viewer.model.state.app_state import AppState
from viewer.model.state.preferences import Section, Theme, Units, is_seen_open, with_sections

FONT_SCALE_LIMITS = 0.6, 2.5


def set_theme(state: AppState, theme: Theme) -> AppState:
    """Show the panels in these colours."""
    return replace(state, preferences=replace(state.preferences, theme=theme))


def set_font_scale(state: AppState, scale: float) -> AppState:
    """Scale text and widgets by a factor."""
    return replace(state, preferences=replace(state.preferences, font_scale=clamp(scale, *FONT_SCALE_LIMITS)))


def set_units(state: AppState, units: Units) -> AppState:
    """Show distances and apertures in these units."""
    return replace(state, preferences=replace(state.preferences, units=units))


def show_filmstrip(state: AppState, is_shown: bool) -> AppState:
    """Show or hide the filmstrip."""
    return replace(state, preferences=replace(state.preferences, shows_filmstrip=is_shown))


def guess_depth_always(state: AppState, is_wanted: bool) -> AppState:
    """Decide whether photos without depth keep a guess although a model is here."""
    return replace(state, preferences=replace(state.preferences, guesses_depth=is_wanted))


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
