"""Preferences: what the user sets once, for every photo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from iibr_core.exports.photo_folder import FolderOrder
from viewer.model.state.stereo import Monitor, StereoMode

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
