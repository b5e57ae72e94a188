"""Disparity of light fields that was found before: kept on disk with the order of their views and the notes."""

from __future__ import annotations

import hashlib
import json
from typing import NamedTuple

from iibr_core.depth.models.cache import load_map, store_map
from iibr_core.formats.files import stamp_of
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.order import Arrangement
from iibr_core.types import FloatImage, GridShape

VERSION = 1
"""Number to raise when disparity is found otherwise."""


class FoundDisparity(NamedTuple):
    """Disparity (H, W) of the centre view of a light field, the order of its views, and all notes about it."""

    values: FloatImage
    arrangement: Arrangement
    notes: tuple[str, ...]


def key_of_field(field: MultiView, given: Arrangement) -> str:
    """Return a name for the disparity of a light field, by path, size and time of its files and by the given order."""
    places = [(str(view.path.resolve()), stamp_of(view.path), view.place) for view in field.views]
    return hashlib.sha256(repr((VERSION, places, field.numbers, given)).encode("utf-8", "surrogatepass")).hexdigest()


def load_found(key: str) -> FoundDisparity | None:
    """Return what was found before, None if nothing was, or it is damaged."""
    if (kept := load_map(key)) is None:
        return None
    values, text = kept
    order, grid, flip, row_step, notes = json.loads(text)
    return FoundDisparity(values, Arrangement(order, grid and GridShape(*grid), flip, row_step), tuple(notes))


def store_found(key: str, found: FoundDisparity) -> None:
    """Keep what was found."""
    order = found.arrangement
    store_map(key, found.values, json.dumps([order.order, order.grid, order.flip, order.row_step, found.notes]))
