"""Views between those of a light field, made beside the window: what is asked for, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.types import ViewUpdate
from viewer.model.state.scene import Scene, Source


@dataclass(frozen=True, eq=False)
class FilledField:
    """A light field with all views between those on disk. views: of all its places, the centre first."""

    scene: Scene
    views: tuple[ViewUpdate, ...]

    def is_of(self, source: Source) -> bool:
        """Whether opening this shows these views."""
        return is_same_field(self.scene.source, source) and self.scene.source.filled_grid == source.filled_grid


@dataclass(frozen=True)
class FillTask:
    """Make the views that this light field is to have between its own; a fill of it that runs is given up."""

    source: Source


@dataclass(frozen=True)
class ViewsFilled:
    """They are all there."""

    field: FilledField


def is_same_field(one: Source, other: Source) -> bool:
    """Whether the views of both are the same, but for those between: a map of its own gives them another disparity."""
    same_map = one.depth.file == other.depth.file
    return one.path == other.path and same_map and one.inpaint == other.inpaint
