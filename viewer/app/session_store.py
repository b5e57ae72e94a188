"""Sessions: what a photo was left with (lens, viewpoint, depth edits), kept in the user's folder for the next time.

A session is found by the photo's path, size and time of change. It is written while the window is used, in a thread.
"""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from iibr_core.formats.files import read_text
from iibr_core.formats.outputs import make_folder, write_file
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import InputError
from viewer.model import messages, opening
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.look import paste_look
from viewer.model.messages import Notice
from viewer.model.remedies import words_of
from viewer.model.saving import SavedSettings, settings_of

SESSIONS_FOLDER = "sessions"
"""Name of the folder of sessions within that of the user's settings."""
QUIET_S = 2.0
"""Time without changes after which a session is written, in seconds."""
MAX_SESSIONS = 1000
MAX_BYTES = 20_000_000
"""Largest session that is read, in bytes."""


class SessionStore:
    """Reads and writes sessions. Call it from the window's thread."""

    def __init__(self, folder: Path | None, wake: Callable[[], None]) -> None:
        """folder: of the user's settings; None keeps nothing. wake: called, in the thread, when a session was read."""
        self._folder = None if folder is None else folder / SESSIONS_FOLDER
        self._wake = wake
        self._executor = ThreadPoolExecutor(1, "iibr-sessions")
        self._scene: Scene | None = None
        self._search: Future[tuple[SavedSettings, str] | None] | None = None
        self._writes: list[Future[None]] = []
        self._saved: SavedSettings | None = None
        self._latest: SavedSettings | None = None
        self._changed_at = 0.0
        self._has_failed = False

    def advance(self, state: AppState) -> list[Action]:
        """Look for the session of a scene that was just opened, and write what was changed a while ago.

        A look that the photo is to have comes after its session.
        """
        actions, wanted_for = self._sessions(state), state.look and state.look.wanted_for
        is_ready = state.scene is not None and state.scene.source is wanted_for and not state.scene.is_sketch
        return [do(paste_look)] if is_ready and self._search is None and not actions else actions

    def _sessions(self, state: AppState) -> list[Action]:
        if self._folder is None:
            return []
        actions, scene = self._take_search(state) + self._report_failure(), state.scene
        if actions or scene is None or scene.is_sketch or scene.source is not state.source:
            return actions
        if self._scene is not None and _has_other_model(self._scene.source, scene.source):
            self._scene = scene
        if self._scene is None or self._scene.source is not scene.source:
            self._save()
            self._scene = scene
            self._saved = self._latest = _settings_now(state, scene)
            self._search = self._executor.submit(_read, self._folder, scene.source)
            self._search.add_done_callback(lambda _: self._wake())
        elif self._search is None and state.stroke is None:
            self._follow(_settings_now(state, scene))
        return []

    def keep(self, state: AppState) -> None:
        """Write the session of the open photo."""
        if self._search is None and self._scene is not None and state.source is self._scene.source:
            self._latest = _settings_now(state, self._scene)
        self._save()

    def close(self) -> None:
        """Wait until all sessions are written."""
        self._executor.shutdown()

    def _follow(self, settings: SavedSettings) -> None:
        saved = self._saved
        is_same = saved is not None and (saved.source, saved.focused_at) == (settings.source, settings.focused_at)
        is_estimated = saved is not None and is_same and _model(settings) != _model(saved)
        if saved is None or (self._latest == saved and is_estimated):
            self._saved = self._latest = settings  # as it was opened: the user has changed nothing
        elif settings != self._latest:
            self._latest, self._changed_at = settings, time.monotonic()
        elif settings != self._saved and time.monotonic() - self._changed_at > QUIET_S:
            self._save()

    def _save(self) -> None:
        if self._folder is None or self._scene is None or self._latest is None or self._latest == self._saved:
            return
        self._writes.append(self._executor.submit(_write, self._folder, self._scene.source, self._latest))
        self._saved = self._latest

    def _take_search(self, state: AppState) -> list[Action]:
        if self._search is None or self._scene is None or not self._search.done():
            return []
        search, self._search = self._search, None
        try:
            found = search.result()
        except InputError as error:
            return [do(messages.notify, Notice(str(error)))]
        if found is None or state.scene is None or state.scene.source is not self._scene.source:
            return []
        self._saved = self._latest = None  # what is restored counts as written, once it is shown
        return [do(opening.restore_session, *found)]

    def _report_failure(self) -> list[Action]:
        """Return a notice for the first session that cannot be written."""
        errors = [write.exception() for write in self._writes if write.done()]
        self._writes = [write for write in self._writes if not write.done()]
        error = next((error for error in errors if error is not None), None)
        is_new, self._has_failed = not self._has_failed, self._has_failed or error is not None
        text = f"Your changes are not kept for the next time. {error}."
        return [do(messages.notify, Notice(text))] if error is not None and is_new else []


def key_of(source: Source) -> str:
    """Return the name of a photo's session: a digest of its file's path, size and time of change, and of how depth is
    read. A folder has only its path. A depth model that was chosen since does not change the name.
    """
    path, depth = Path(os.path.abspath(source.path)), source.depth
    status = path.stat() if path.is_file() else None
    stamp = None if status is None else (status.st_size, status.st_mtime_ns)
    start = "auto" if depth.start == "model" else depth.start
    reading = depth.file and str(depth.file), depth.file_scale, depth.inverts, depth.is_metric, depth.stretches, start
    return hashlib.blake2b(repr((str(path), stamp, reading)).encode(), digest_size=16).hexdigest()


def _has_other_model(before: Source, now: Source) -> bool:
    """Return whether a source is the same but for the depth model that was chosen for it."""
    depth = before.depth
    starts = (depth.start, "model")
    is_same = replace(before, depth=replace(depth, start=now.depth.start, model=now.depth.model)) == now
    return is_same and now.depth.model != depth.model and now.depth.start in starts


def _settings_now(state: AppState, scene: Scene) -> SavedSettings:
    return replace(settings_of(state.at_rest, scene.size), depth_model=scene.depth_model or "")


def _model(settings: SavedSettings) -> tuple[bool, str]:
    return settings.has_model_depth, settings.depth_model


def _read(folder: Path, source: Source) -> tuple[SavedSettings, str] | None:
    """Return the session of a photo, and why its depth model cannot be used, "" if it can; None without a session."""
    from viewer.model.saved_settings import settings_from_text

    path = folder / f"{key_of(source)}.json"
    if not path.is_file():
        return None
    settings, lost = settings_from_text(read_text(path, MAX_BYTES), str(path), is_own=True), ""
    if settings.depth_model:
        from iibr_core.depth.models.catalog import wanted_model

        try:
            wanted_model(settings.depth_model)
        except InputError as error:
            lost = words_of(error)
    return settings, lost


def _write(folder: Path, source: Source, settings: SavedSettings) -> None:
    from viewer.model.saved_settings import settings_text

    make_folder(folder)
    with write_file(folder / f"{key_of(source)}.json") as temporary:
        temporary.write_text(settings_text(settings), "utf-8")
    kept = sorted(folder.glob("*.json"), key=lambda path: path.stat().st_mtime)
    for path in kept[:-MAX_SESSIONS]:
        path.unlink(missing_ok=True)
