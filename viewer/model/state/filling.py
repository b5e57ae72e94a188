"""Views between those of a light field, made beside the window: what is asked for, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.scenes.scene import FilledField, Source


@dataclass(frozen=True)
class FillTask:
    """Make the views that this light field is to have between its own; a fill of it that runs is given up."""

    source: Source


@dataclass(frozen=True)
class ViewsFilled:
    """They are all there."""

    field: FilledField
