"""Files dropped on the window -> actions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from iibr_core.formats.maps.map_names import is_map_path
from iibr_core.scenes.scene import Source, source_beside, source_with_map
from viewer.model import opening
from viewer.model.action import Action, do
from viewer.model.app_state import AppState


def actions_from_drop(paths: Sequence[str], state: AppState) -> list[Action]:
    """Open the dropped photo, with a depth map that was dropped with it; a map alone is for the photo that is open."""
    maps = [path for path in paths if is_map_path(PurePath(path))]
    others = [path for path in paths if path not in maps]
    if others:
        source = source_beside(state.source, others[0])
        return [do(opening.open_source, source_with_map(source, maps[0]) if maps else source)]
    if maps and state.source:
        return [do(opening.open_source, source_with_map(state.source, maps[0]))]
    return [do(opening.open_source, Source(path)) for path in maps[:1]]
