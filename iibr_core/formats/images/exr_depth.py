"""Depth in an OpenEXR picture: a channel beside its colours, as renderers write it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from iibr_core.formats.files import MAX_FILE_PIXELS
from iibr_core.formats.images.decode import complaint_of, open_header
from iibr_core.types import FloatImage, InputError

DEPTH_CHANNEL = re.compile(r"(?:.*\.)?(?:Z|depth|depth\.[YVRXZ])", re.IGNORECASE)
"""Names of the channel: `Z` by the format's convention, `ViewLayer.Depth.Z` by Blender."""
MAX_PARTS = 64
BACKGROUND = 1e9
"""Smallest distance that stands for no surface."""


def read_depth_channel(path: Path) -> FloatImage | None:
    """Return distances (H, W) float32, infinite without a surface; None where a file is no EXR, or has no such channel.

    Raises InputError where the file is damaged.
    """
    if path.suffix.lower() != ".exr":
        return None
    source = open_header(path)
    if source is None:
        return None
    for part in range(MAX_PARTS):
        if not source.seek_subimage(part, 0):
            complaint_of(source)
            return None
        spec = source.spec()
        found = [k for k, name in enumerate(spec.channelnames) if DEPTH_CHANNEL.fullmatch(name)]
        # A map that is all of its file is no picture with depth.
        if found and (part > 0 or spec.nchannels > 2) and spec.width * spec.height <= MAX_FILE_PIXELS:
            values = source.read_image(part, 0, found[0], found[0] + 1, "float")
            if values is None:
                raise InputError(f"{path}: its depth channel is damaged ({complaint_of(source)}); get the file again")
            depth = np.asarray(values, np.float32).reshape(spec.height, spec.width)
            return np.where(depth >= BACKGROUND, np.float32(np.inf), depth)
    return None
