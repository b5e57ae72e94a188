"""What outlasts the program: preferences and recent files, as JSON in the user's own folder. Damage counts as none."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from pathlib import Path
from typing import Any

from iibr_core.formats.files import atomic_write
from iibr_core.types import InputError
from viewer.model.lens.limits import FONT_SCALE_LIMITS, clamp
from viewer.model.reducers.worker_events import RECENT_KEPT
from viewer.model.state.app_state import SECTIONS, AppState, Notice, Preferences

PREFERENCES_FILE = "preferences.json"
RECENT_FILE = "recent.json"
LARGEST_COORDINATE = 100_000


def user_folder() -> Path:
    """The user's folder for this program's settings; it may not exist yet."""
    from platformdirs import user_config_path

    return user_config_path("iibr", appauthor=False)


def load_preferences(state: AppState, folder: Path) -> AppState:
    """The state with what was kept; a damaged file is left out, with a notice."""
    preferences, recent, notices = state.preferences, state.recent, state.notices
    try:
        preferences = _preferences(_read(folder / PREFERENCES_FILE))
    except InputError as error:
        notices = (*notices, Notice(f"{error}; the usual preferences are used"))
    try:
        recent = _recent(_read(folder / RECENT_FILE))
    except InputError as error:
        notices = (*notices, Notice(f"{error}; the list of recent files starts anew"))
    return dataclasses.replace(state, preferences=preferences, recent=recent, notices=notices)


def store_preferences(state: AppState, folder: Path) -> None:
    """Write preferences and recent files. Raises InputError where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror or error}); preferences are not kept") from error
    _write(folder / PREFERENCES_FILE, dataclasses.asdict(state.preferences))
    # absolute: the program may be started elsewhere the next time
    _write(folder / RECENT_FILE, [os.path.abspath(path) for path in state.recent])


def _write(path: Path, value: Any) -> None:
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(value, indent=1), "utf-8")


def _read(path: Path) -> Any:
    """What the file holds; None where there is none. Raises InputError where it is damaged."""
    if not path.exists():
        return None
    try:
        return json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({' '.join(str(error).split())[:80]})") from error


def _preferences(kept: Any) -> Preferences:
    """Each value that makes sense; the usual one for each that does not."""
    usual = Preferences()
    if kept is None:
        return usual
    if not isinstance(kept, dict):
        raise InputError(f"{PREFERENCES_FILE}: damaged (no object)")
    theme, scale, sections = kept.get("theme"), kept.get("font_scale"), kept.get("open_sections")
    is_scale = isinstance(scale, int | float) and 0 < scale < math.inf
    return Preferences(
        theme="light" if theme == "light" else "dark",
        font_scale=clamp(float(scale or 1), *FONT_SCALE_LIMITS) if is_scale else usual.font_scale,
        open_sections=tuple(s for s in SECTIONS if s in sections)
        if isinstance(sections, list)
        else usual.open_sections,
        window=_place(kept.get("window")),
    )


def _place(kept: Any) -> tuple[int, int, int, int] | None:
    if not isinstance(kept, list) or len(kept) != 4 or not all(type(value) is int for value in kept):
        return None
    x, y, width, height = kept
    is_possible = max(map(abs, kept)) <= LARGEST_COORDINATE and width >= 200 and height >= 150
    return (x, y, width, height) if is_possible else None


def _recent(kept: Any) -> tuple[str, ...]:
    if kept is None:
        return ()
    if not isinstance(kept, list) or not all(isinstance(path, str) and path for path in kept):
        raise InputError(f"{RECENT_FILE}: damaged (no list of paths)")
    return tuple(dict.fromkeys(kept))[:RECENT_KEPT]
