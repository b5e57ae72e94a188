"""Files dropped on the window -> actions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from iibr_core.scenes.scene import Source, source_beside, source_with_map
from viewer.model import opening
from viewer.model.action import Action, do
from viewer.model.state.app_state import AppState

MAP_SUFFIXES = (".pfm", ".npy", ".npz")
MAP_NAMES = ("_depth", "_disparity")
"""At the end of a map's name, whatever kind of file it is."""


def actions_from_drop(paths: Sequence[str], state: AppState) -> list[Action]:
    """Open the dropped photo, with a depth map that was dropped with it; a map alone is for the photo that is open."""
    maps = [path for path in paths if _is_map(PurePath(path))]
    others = [path for path in paths if path not in maps]
    if others:
        source = source_beside(state.source, others[0])
        return [do(opening.open_source, source_with_map(source, maps[0]) if maps else source)]
    if maps and state.source:
        return [do(opening.open_source, source_with_map(state.source, maps[0]))]
    return [do(opening.open_source, Source(path)) for path in maps[:1]]


def _is_map(path: PurePath) -> bool:
    return path.suffix.lower() in MAP_SUFFIXES or path.stem.lower().endswith(MAP_NAMES)
