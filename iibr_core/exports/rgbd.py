"""A picture with its depth beside it, bright is near: what light-field displays and their players make views of."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from iibr_core.color import bytes_from_encoded
from iibr_core.exports.camera_export import colors_of
from iibr_core.exports.pictures import write_with_metadata
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.types import InputError


def write_beside(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Depth at the right; the others likewise: raises InputError where nothing tells depth or it cannot be written."""
    _write(path, source, axis=1, is_first=False)


def write_before(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Depth at the left."""
    _write(path, source, axis=1, is_first=True)


def write_below(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Depth below."""
    _write(path, source, axis=0, is_first=False)


def _write(path: Path, source: ExportSource, axis: int, is_first: bool) -> None:
    view = source.centre_view()
    if view.disparity is None:
        raise InputError(f"{source.scene.name}: has no depth")
    far, near = float(view.disparity.min()), float(view.disparity.max())
    nearness = (view.disparity - far) / ((near - far) or 1.0)
    pictures = [colors_of(view), np.repeat(bytes_from_encoded(nearness)[..., None], 3, axis=2)]
    write_with_metadata(path, np.concatenate(pictures[::-1] if is_first else pictures, axis=axis), source)
