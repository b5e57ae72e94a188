"""What a photo was left with (lens, viewpoint, depth edits), kept for the next time it is opened: in the user's folder,
by what is in the photo's file, so that it may be moved and renamed. Written while the window is used: it may crash.
"""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path

from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.formats.files import read_text
from iibr_core.formats.outputs import write_file
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import InputError
from viewer.app.image_export import settings_of
from viewer.background.file_worker import FileRequest, FileWorker
from viewer.background.job_threads import Failed
from viewer.model import messages
from viewer.model.action import do
from viewer.model.actions import Action, RestoreSession, SetState
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice
from viewer.model.state.preferences import SetPreference
from viewer.model.state.saving import SavedSettings

EDITS_KEPT = "Your depth edits are kept: this photo opens as you leave it. Save the depth map to use it elsewhere."
FOLDER = "sessions"
SIDECAR_ENDING = ".iibr"
QUIET_S = 2.0
"""So long nothing must have changed before it is written."""
HASHED_AT_ONCE = 1 << 20
MOST_KEPT = 1000
MOST_BYTES = 20_000_000
"""Of one: more than settings may have."""


@dataclass(frozen=True, eq=False)
class SessionFound:
    """What was kept for a scene, None where nothing was. problem: why it cannot be used, "" where it can."""

    scene: Scene
    settings: SavedSettings | None
    problem: str = ""


class SessionStore:
    """Call it from the window's thread; files are read and written in one of its own."""

    def __init__(self, folder: Path | None, wake: Callable[[], None]) -> None:
        """folder: of the user's settings; None: nothing is kept. wake: called, in the thread, when there is news."""
        self._folder = None if folder is None else folder / FOLDER
        self._files = FileWorker("iibr-sessions", wake)
        self._ids = count(1)
        self._scene: Scene | None = None
        self._is_known = self._can_write = False
        self._kept: SavedSettings | None = None
        self._latest: SavedSettings | None = None
        self._changed_at = 0.0
        self._has_failed = False

    def run(self, state: AppState) -> list[Action]:
        """Look for what was kept where another scene is open, and keep what was changed a while ago."""
        if self._folder is None:
            return []
        actions = self._take_results(state)
        scene = state.scene
        if actions or scene is None or scene.is_sketch or scene.source is not state.source:
            return actions
        if self._scene is None or self._scene.source is not scene.source:
            self._leave()
            self._scene, self._is_known = scene, False
            self._submit(partial(_find, self._folder, scene))
        elif self._is_known and state.stroke is None:
            self._follow(settings_of(state.at_rest, scene.size))
        return self._tell(state)

    def _tell(self, state: AppState) -> list[Action]:
        """Whether closing loses nothing, where that changed; once, that it does not."""
        are_kept = self._is_known and self._can_write and not self._has_failed
        if are_kept != state.keeps_sessions:
            return [SetState("keeps_sessions", are_kept)]
        is_edited = state.depth.edits not in (UNEDITED, state.saved_edits)
        if not (are_kept and is_edited) or state.preferences.told_sessions:
            return []
        return [SetPreference("told_sessions", True), do(messages.notify, Notice(EDITS_KEPT))]

    def close(self, state: AppState) -> None:
        """Keep what is there now, and wait until it is written."""
        if self._is_known and self._scene is not None and state.source is self._scene.source:
            self._latest = settings_of(state.at_rest, self._scene.size)
        self._leave()
        self._files.close(cancels=False)

    def _follow(self, settings: SavedSettings) -> None:
        now = time.monotonic()
        if self._kept is None:
            self._kept = self._latest = settings  # as it was opened: nothing to keep yet
        elif self._latest == self._kept and settings.has_model_depth != self._kept.has_model_depth:
            self._kept = self._latest = settings  # the user did nothing
        if settings != self._latest:
            self._latest, self._changed_at = settings, now
        elif settings != self._kept and now - self._changed_at > QUIET_S:
            self._leave()

    def _leave(self) -> None:
        """Have what was changed written."""
        if self._scene is None or self._folder is None or self._latest == self._kept or self._latest is None:
            return
        self._submit(partial(_keep, self._folder, self._scene.source, self._latest))
        self._kept = self._latest

    def _submit(self, work: Callable[[], object]) -> None:
        self._files.submit(FileRequest(next(self._ids), work))

    def _take_results(self, state: AppState) -> list[Action]:
        actions: list[Action] = []
        while (result := self._files.next_result()) is not None:
            if isinstance(result, Failed):
                actions += [] if self._has_failed else [do(messages.notify, Notice(result.message))]
                self._has_failed = True  # once is enough
            elif isinstance(result.value, SessionFound) and result.value.scene is self._scene:
                actions += self._take_up(result.value, state)
        return actions

    def _take_up(self, found: SessionFound, state: AppState) -> list[Action]:
        self._is_known, self._kept, self._latest = True, None, None
        self._can_write = self._folder is not None and _can_write(self._folder)
        if found.problem:
            return [do(messages.notify, Notice(found.problem))]
        is_open = state.scene is not None and state.scene.source is found.scene.source
        if not is_open or found.settings is None:
            return []
        from viewer.model.saved_settings import left_out_note

        note = left_out_note(found.settings)
        return [RestoreSession(found.settings), *([do(messages.notify, Notice(note))] if note else [])]


def sidecar_of(path: Path) -> Path:
    """Where the same lies beside a photo, where that was asked for."""
    return path.with_name(path.name + SIDECAR_ENDING)


def write_sidecar(path: Path, settings: SavedSettings) -> Path:
    """Write them beside a photo; where that is. Raises InputError."""
    _write(sidecar_of(path), settings)
    return sidecar_of(path)


def _find(folder: Path, scene: Scene) -> SessionFound:
    """What was kept in the folder, else beside the photo: a stranger may have put that there."""
    from viewer.model.saved_settings import settings_from_text

    sidecar = sidecar_of(Path(scene.source.path))
    kept = folder / f"{key_of(scene.source)}.json"
    try:
        if kept.is_file():
            return SessionFound(scene, settings_from_text(read_text(kept, MOST_BYTES), str(kept), is_own=True))
        if sidecar.is_file():
            return SessionFound(scene, settings_from_text(read_text(sidecar, MOST_BYTES), str(sidecar)))
    except InputError as error:
        return SessionFound(scene, None, str(error))
    return SessionFound(scene, None)


def _can_write(folder: Path) -> bool:
    """Whether files can be made in a folder, or in the one that it will be made in."""
    there = next(place for place in (folder, *folder.parents) if os.path.lexists(place))
    return there.is_dir() and os.access(there, os.W_OK)


def _keep(folder: Path, source: Source, settings: SavedSettings) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror or error}); what you do is not kept") from error
    _write(folder / f"{key_of(source)}.json", settings)
    _forget_oldest(folder)


def _write(path: Path, settings: SavedSettings) -> None:
    from viewer.model.saved_settings import settings_text

    with write_file(path) as temporary:
        temporary.write_text(settings_text(settings), "utf-8")


def _forget_oldest(folder: Path) -> None:
    kept = list(folder.glob("*.json"))
    if len(kept) > MOST_KEPT:
        for path in sorted(kept, key=lambda path: path.stat().st_mtime)[: len(kept) - MOST_KEPT]:
            path.unlink(missing_ok=True)


def key_of(source: Source) -> str:
    """Return the name under which a photo's session is kept.

    It depends on the content of the photo's file, or the path of a folder, and on the map and how it is read: that is
    what edits are made on. A model that was chosen since does not change it. Raises InputError where the file is gone.
    """
    path, depth = Path(source.path), source.depth
    digest = hashlib.blake2b(digest_size=16)
    start = "auto" if depth.start == "model" else depth.start
    reading = (depth.file_scale, depth.inverts, depth.is_metric, depth.stretches)
    digest.update(repr((depth.file and str(depth.file), *reading, start)).encode())
    if path.is_dir():
        digest.update(str(path.absolute()).encode("utf-8", "surrogateescape"))
        return digest.hexdigest()
    try:
        with path.open("rb") as file:
            while part := file.read(HASHED_AT_ONCE):
                digest.update(part)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; what you do with it is not kept") from error
    return digest.hexdigest()
