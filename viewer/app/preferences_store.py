"""Preferences and recent files, kept as JSON in the user's folder.

msgspec is imported late: it takes 10 to 40 ms, which a window without preferences need not wait for.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from platformdirs import user_config_path

from iibr_core.formats.files import read_text
from iibr_core.formats.outputs import make_folder, write_file
from iibr_core.scenes.lens_limits import clamp
from iibr_core.types import InputError
from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.messages import Notice
from viewer.model.opening import MAX_RECENT
from viewer.model.preferences import FONT_SCALE_LIMITS, Preferences
from viewer.model.tracking import HEAD_RANGE_LIMITS

PREFERENCES_FILE = "preferences.json"
RECENT_FILE = "recent.json"
MAX_BYTES = 1_000_000
"""Largest size of each of these files, in bytes."""
Value = TypeVar("Value")


def user_folder() -> Path:
    """Return the user's folder for the settings of this program; it may not exist yet."""
    return user_config_path("iibr", appauthor=False)


def load_preferences(state: AppState, folder: Path) -> AppState:
    """Return the state with what was kept. A damaged file gives the usual values and a notice."""
    kept, damage = _read(folder / PREFERENCES_FILE, state.preferences, "The usual preferences are used.")
    recent, more = _read(folder / RECENT_FILE, state.recent, "The list of recent files is empty.")
    last, opened = (path if os.path.isdir(path) else "" for path in (kept.last_folder, kept.opened_folder))
    font_scale, head_cm = clamp(kept.font_scale, *FONT_SCALE_LIMITS), clamp(kept.head_range_cm, *HEAD_RANGE_LIMITS)
    kept = replace(kept, font_scale=font_scale, head_range_cm=head_cm, last_folder=last, opened_folder=opened)
    return replace(state, preferences=kept, recent=recent[:MAX_RECENT], notices=(*state.notices, *damage, *more))


def last_opened(folder: Path) -> str | None:
    """Return the path that was open last, if it still exists."""
    recent, _ = _read(folder / RECENT_FILE, AppState().recent, "")
    return recent[0] if recent and os.path.exists(recent[0]) else None


def store_preferences(state: AppState, folder: Path) -> None:
    """Write preferences and recent files. Raises InputError."""
    make_folder(folder)
    # absolute: the program may be started elsewhere the next time; JSON holds no bytes that are not text
    recent = [os.path.abspath(path).encode(errors="replace").decode() for path in state.recent]
    _write(folder / PREFERENCES_FILE, state.preferences)
    _write(folder / RECENT_FILE, recent)


class PreferencesKeeper:
    """Writes preferences and recent files as soon as they change, so that a crash loses none."""

    def __init__(self, state: AppState, folder: Path | None) -> None:
        """folder: None keeps nothing. state: as it was read from there."""
        self._folder, self._kept = folder, _without_place(state)

    def advance(self, state: AppState) -> list[Action]:
        """Write them if they changed."""
        return [] if _without_place(state) == self._kept else self.keep(state)

    def keep(self, state: AppState) -> list[Action]:
        """Write them; return a notice if that fails."""
        self._kept = _without_place(state)
        if self._folder is None:
            return []
        try:
            store_preferences(state, self._folder)
        except InputError as error:
            text = f"Settings and recent photos are not kept. {error}."
            return [do(messages.notify, Notice(text, is_error=True))]
        return []


def _without_place(state: AppState) -> tuple[tuple[str, ...], Preferences]:
    """Return recent files and preferences without the window's place, which changes with each of its moves."""
    return state.recent, replace(state.preferences, window=None)


def _write(path: Path, value: object) -> None:
    import msgspec

    with write_file(path) as temporary:
        temporary.write_bytes(msgspec.json.format(msgspec.json.encode(value), indent=1))


def _read(path: Path, usual: Value, consequence: str) -> tuple[Value, list[Notice]]:
    """Return the value that the file holds; the usual one without a file, and with a notice if it is damaged."""
    if not path.exists():
        return usual, []
    import msgspec

    kind: Any = Preferences if isinstance(usual, Preferences) else tuple[str, ...]
    try:
        return msgspec.json.decode(read_text(path, MAX_BYTES), type=kind), []
    except (ValueError, RecursionError) as error:
        reason = (
            str(error) if isinstance(error, InputError) else f"{path}: damaged ({' '.join(str(error).split())[:80]})"
        )
        return usual, [Notice(f"{reason}. {consequence}")]
