"""Changes of what outlasts the session."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from iibr_core.scenes.lens_limits import clamp
from viewer.model.state.preferences import (
    PlaceWindow,
    Preferences,
    PreferencesAction,
    SetPreference,
    ToggleSection,
    is_seen_open,
    with_sections,
)
from viewer.model.window_limits import FONT_SCALE_LIMITS


def reduce_preferences(preferences: Preferences, action: PreferencesAction) -> Preferences:
    """The preferences after an action. A size of text that is not finite leaves them as they are."""
    match action:
        case SetPreference("font_scale", float(scale)):
            scale = clamp(scale, *FONT_SCALE_LIMITS) if math.isfinite(scale) else preferences.font_scale
            return replace(preferences, font_scale=scale)
        case SetPreference(field, value):
            change: dict[str, Any] = {field: value}
            return replace(preferences, **change)
        case ToggleSection(section):
            sections = preferences.open_sections
            if is_seen_open(section, sections):
                return replace(preferences, open_sections=tuple(other for other in sections if other != section))
            return replace(preferences, open_sections=with_sections(sections, section))
        case PlaceWindow(place):
            return replace(preferences, window=place or preferences.window, is_maximized=place is None)
    return preferences
