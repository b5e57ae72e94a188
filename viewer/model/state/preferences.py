"""What the user sets once, for every photo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.exports import FolderOrder

Theme = Literal["dark", "light"]
Units = Literal["photographic", "light field"]
"""near to far and f-numbers, or pixels per view step and view steps."""

Section = Literal["view", "focus", "aperture", "light", "gloss", "depth", "inspect", "scene"]
SECTIONS: tuple[Section, ...] = ("view", "focus", "aperture", "light", "gloss", "depth", "inspect", "scene")


@dataclass(frozen=True)
class Preferences:
    """What outlasts the program. window: x, y, width, height in screen units, None before the first; is_maximized:
    whether it filled the screen then. told_sessions: that depth edits are kept; told_aperture: that
    focusing opens the aperture. Each is told once. told_drag: that one drags to look; it is told until one does.
    estimates_depth: photos without depth get it from the recommended model, without a question, once it is here.
    """

    theme: Theme = "dark"
    font_scale: float = 1.0
    open_sections: tuple[Section, ...] = ("view", "focus", "aperture", "light")
    window: tuple[int, int, int, int] | None = None
    is_maximized: bool = False
    shows_filmstrip: bool = False
    folder_order: FolderOrder = "name"
    units: Units = "photographic"
    told_sessions: bool = False
    told_aperture: bool = False
    told_drag: bool = False
    estimates_depth: bool = False


@dataclass(frozen=True)
class SetPreference:
    """Give one field of `Preferences` this value; the others have actions of their own, for more depends on them."""

    field: Literal["theme", "font_scale", "units", "shows_filmstrip", "told_sessions", "estimates_depth"]
    value: Theme | float | Units | bool


@dataclass(frozen=True)
class ToggleSection:
    """Open or close a section of the panel."""

    section: Section


@dataclass(frozen=True)
class PlaceWindow:
    """The window is here: x, y, width, height in screen units; None: where it was, while it fills the screen."""

    place: tuple[int, int, int, int] | None


PreferencesAction = SetPreference | ToggleSection | PlaceWindow
