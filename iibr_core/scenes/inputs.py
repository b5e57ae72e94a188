"""Files and folders that opening a scene reads."""

import os
from pathlib import Path

from iibr_core.depth.sidecar import map_to_read
from iibr_core.scenes.scene import Source


def inputs_of(source: Source) -> tuple[Path, ...]:
    """Return the files and folders that opening a source reads, with the map beside a photo and folders of models.

    Outputs must not replace them, see `check_output`.
    """
    named, found = named_by(source), map_to_read(Path(source.path), source.depth)
    return named if found is None or found in named else (*named, found)


def named_by(source: Source) -> tuple[Path, ...]:
    """Return the photo or folder, the map and the folders of models that a source names."""
    models = (source.depth.model or "", source.inpaint.partition(":")[2])
    folders = [path for path in map(os.path.expanduser, models) if path and os.path.lexists(path)]  # else: names
    return tuple(Path(path) for path in (source.path, source.depth.file, source.depth.right, *folders) if path)
