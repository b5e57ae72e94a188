"""What outlasts the program: preferences and recent files, as JSON in the user's own folder.

Read by hand, in no time: it is done before the window opens, where importing a library for it takes 10 to 40 ms.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from platformdirs import user_config_path

from iibr_core.exports.photo_folder import FolderOrder
from iibr_core.formats.files import read_text
from iibr_core.formats.outputs import write_file
from iibr_core.scenes.lens_limits import clamp
from iibr_core.types import InputError
from viewer.model import messages
from viewer.model.action import do
from viewer.model.actions import Action
from viewer.model.reducers.worker_events import RECENT_KEPT
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice
from viewer.model.state.preferences import SECTIONS, Preferences, Section, Theme, Units
from viewer.model.window_limits import FONT_SCALE_LIMITS

PREFERENCES_FILE = "preferences.json"
RECENT_FILE = "recent.json"
LARGEST_COORDINATE = 100_000
MOST_BYTES = 1_000_000
"""Of one of these files."""
LEFT_OUT_TOLD = 4


def user_folder() -> Path:
    """The user's folder for this program's settings; it may not exist yet."""
    return user_config_path("iibr", appauthor=False)


def load_preferences(state: AppState, folder: Path) -> AppState:
    """The state with what was kept; a damaged file or value is left out, with a notice that names it."""
    preferences, recent, notices = state.preferences, state.recent, state.notices
    try:
        preferences, left_out = _preferences(_read(folder / PREFERENCES_FILE))
        if left_out:
            names = f"{', '.join(left_out[:LEFT_OUT_TOLD])}{' …' * (len(left_out) > LEFT_OUT_TOLD)}"
            path = folder / PREFERENCES_FILE
            notices = (*notices, Notice(f"{path}: not understood and left out: {names}; the rest counts"))
    except InputError as error:
        notices = (*notices, Notice(f"{error}; the usual preferences are used"))
    try:
        recent = _recent(_read(folder / RECENT_FILE))
    except InputError as error:
        notices = (*notices, Notice(f"{error}; the list of recent files starts again"))
    return dataclasses.replace(state, preferences=preferences, recent=recent, notices=notices)


def last_opened(folder: Path) -> str | None:
    """Path of what was open last, if it is still there."""
    with suppress(InputError, OSError, ValueError):
        path = next(iter(_recent(_read(folder / RECENT_FILE))), None)
        return path if path is not None and os.path.exists(path) else None
    return None


def store_preferences(state: AppState, folder: Path) -> None:
    """Write preferences and recent files. Raises InputError where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # absolute: the program may be started elsewhere the next time
        recent = [os.path.abspath(path) for path in state.recent]
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror or error}); preferences are not kept") from error
    _write(folder / PREFERENCES_FILE, dataclasses.asdict(state.preferences))
    _write(folder / RECENT_FILE, recent)


class PreferencesKeeper:
    """Writes preferences and recent files as soon as they change: they are what one misses after a crash."""

    def __init__(self, state: AppState, folder: Path | None) -> None:
        """folder: None keeps nothing. state: as it was read from there."""
        self._folder, self._kept = folder, _worth_keeping(state)

    def keep_news(self, state: AppState) -> list[Action]:
        """Write them if they changed; says what went wrong."""
        if _worth_keeping(state) == self._kept:
            return []
        self._kept = _worth_keeping(state)
        return self.keep(state)

    def keep(self, state: AppState) -> list[Action]:
        """Write them; says what went wrong."""
        try:
            if self._folder is not None:
                store_preferences(state, self._folder)
        except InputError as error:
            return [do(messages.notify, Notice(str(error), is_error=True))]
        return []


def _worth_keeping(state: AppState) -> tuple[tuple[str, ...], Preferences]:
    """Recent files and preferences, but for where the window is: that changes with every move of it."""
    return state.recent, dataclasses.replace(state.preferences, window=None)


def _write(path: Path, value: Any) -> None:
    with write_file(path) as temporary:
        temporary.write_text(json.dumps(value, indent=1), "utf-8")


def _read(path: Path) -> Any:
    """What the file holds; None where there is none. Raises InputError where it is damaged."""
    try:
        return json.loads(read_text(path, MOST_BYTES)) if path.exists() else None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({' '.join(str(error).split())[:80]})") from error


def _preferences(kept: Any) -> tuple[Preferences, tuple[str, ...]]:
    """Each value that makes sense, the usual one for each that does not, and the names of these and of unknown ones."""
    if kept is None:
        return Preferences(), ()
    if not isinstance(kept, dict):
        raise InputError(f"{PREFERENCES_FILE}: damaged (no object)")
    values: dict[str, Any] = {}
    left_out = [name for name in kept if name not in _READERS]
    for name in _READERS.keys() & kept.keys():
        try:
            values[name] = _READERS[name](kept[name])
        except ValueError:
            left_out.append(name)
    if "open_sections" in values and any(section not in SECTIONS for section in kept["open_sections"]):
        left_out.append("open_sections")  # in part
    return Preferences(**values), tuple(sorted(" ".join(name.split())[:40] for name in left_out))


def _theme(kept: Any) -> Theme:
    if kept not in ("dark", "light"):
        raise ValueError
    return "light" if kept == "light" else "dark"


def _font_scale(kept: Any) -> float:
    if isinstance(kept, bool) or not isinstance(kept, int | float) or not 0 < kept < math.inf:
        raise ValueError
    return clamp(float(min(kept, FONT_SCALE_LIMITS[1])), *FONT_SCALE_LIMITS)


def _sections(kept: Any) -> tuple[Section, ...]:
    if not isinstance(kept, list):
        raise ValueError
    return tuple(section for section in SECTIONS if section in kept)


def _place(kept: Any) -> tuple[int, int, int, int] | None:
    """None, too, where no window can be: that is no damage, for it may have been there."""
    if kept is None:
        return None
    if not isinstance(kept, list) or len(kept) != 4 or not all(type(value) is int for value in kept):
        raise ValueError
    x, y, width, height = kept
    is_possible = max(map(abs, kept)) <= LARGEST_COORDINATE and width >= 200 and height >= 150
    return (x, y, width, height) if is_possible else None


def _units(kept: Any) -> Units:
    if kept not in ("photographic", "light field"):
        raise ValueError
    return "light field" if kept == "light field" else "photographic"


def _folder_order(kept: Any) -> FolderOrder:
    if kept not in ("name", "time"):
        raise ValueError
    return "time" if kept == "time" else "name"


def _folder(kept: Any) -> str:
    """Nothing where it is gone: that is no damage."""
    if not isinstance(kept, str):
        raise ValueError
    return kept if os.path.isdir(kept) else ""


def _yes_or_no(kept: Any) -> bool:
    if not isinstance(kept, bool):
        raise ValueError
    return kept


_READERS: dict[str, Callable[[Any], Any]] = {
    "theme": _theme,
    "font_scale": _font_scale,
    "open_sections": _sections,
    "window": _place,
    "is_maximized": _yes_or_no,
    "shows_filmstrip": _yes_or_no,
    "folder_order": _folder_order,
    "units": _units,
    "told_sessions": _yes_or_no,
    "estimates_depth": _yes_or_no,
    "last_folder": _folder,
}


def _recent(kept: Any) -> tuple[str, ...]:
    if kept is None:
        return ()
    if not isinstance(kept, list) or not all(isinstance(path, str) and path for path in kept):
        raise InputError(f"{RECENT_FILE}: damaged (no list of paths)")
    # JSON may hold halves of characters, which panels cannot show.
    return tuple(dict.fromkeys(path.encode(errors="replace").decode() for path in kept))[:RECENT_KEPT]
