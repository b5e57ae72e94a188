"""Facts that a photo's file states about it."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.state.app_state import AppState
from viewer.model.state.photo_facts import PhotoFacts


def set_facts(state: AppState, facts: PhotoFacts) -> AppState:
    """Show these facts."""
    return replace(state, facts=facts)
