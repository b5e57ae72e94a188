"""What the user sets once, for every photo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.exports.photo_folder import FolderOrder

Theme = Literal["dark", "light"]
Units = Literal["photographic", "light field"]
"""near to far and f-numbers, or pixels per view step and view steps."""

Section = Literal[
    "more", "view", "focus", "aperture", "light", "gloss", "depth", "advanced", "inspect", "scene"
]  # fmt: skip
SECTIONS: tuple[Section, ...] = (
    "more", "view", "focus", "aperture", "light", "gloss", "depth", "advanced", "inspect", "scene",
)  # fmt: skip
"""In their order from above."""
HOLDERS: dict[Section, Section] = {
    "view": "more",
    "focus": "more",
    "aperture": "more",
    "light": "more",
    "gloss": "more",
    "depth": "more",
    "advanced": "more",
    "inspect": "advanced",
    "scene": "advanced",
}
"""Sections that lie in another one, and which: they are seen only while that is open, too."""


def is_seen_open(section: Section, open_sections: tuple[Section, ...]) -> bool:
    """Whether a section is open, and every one that it lies in."""
    return all(each in open_sections for each in _with_holders(section))


def with_sections(open_sections: tuple[Section, ...], *wanted: Section) -> tuple[Section, ...]:
    """The open sections with these, and every one that they lie in, in their order from above."""
    opened = {*open_sections, *(each for section in wanted for each in _with_holders(section))}
    return tuple(section for section in SECTIONS if section in opened)


def _with_holders(section: Section) -> tuple[Section, ...]:
    holder = HOLDERS.get(section)
    return (section,) if holder is None else (section, *_with_holders(holder))


@dataclass(frozen=True)
class Preferences:
    """What outlasts the program. window: x, y, width, height in screen units, None before the first; is_maximized:
    whether it filled the screen then. last_folder: where a picture or an export was put last, "" before the first.
    estimates_depth: photos without depth get it from the recommended model, without a question, once it is here.
    """

    theme: Theme = "dark"
    font_scale: float = 1.0
    open_sections: tuple[Section, ...] = ()
    window: tuple[int, int, int, int] | None = None
    is_maximized: bool = False
    shows_filmstrip: bool = False
    folder_order: FolderOrder = "name"
    units: Units = "photographic"
    estimates_depth: bool = False
    last_folder: str = ""


@dataclass(frozen=True)
class SetPreference:
    """Give one field of `Preferences` this value; the others have actions of their own, for more depends on them."""

    field: Literal["theme", "font_scale", "units", "shows_filmstrip", "estimates_depth", "last_folder"]
    value: Theme | float | Units | bool | str


@dataclass(frozen=True)
class ToggleSection:
    """Close a section of the panel that is seen open; else open it, with those that it lies in."""

    section: Section


@dataclass(frozen=True)
class PlaceWindow:
    """The window is here: x, y, width, height in screen units; None: where it was, while it fills the screen."""

    place: tuple[int, int, int, int] | None


PreferencesAction = SetPreference | ToggleSection | PlaceWindow
