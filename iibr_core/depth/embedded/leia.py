"""Inverse depth in Leia images, of the view that all programs show."""

from __future__ import annotations

from io import BytesIO

from iibr_core.depth.embedded.images import decode_map
from iibr_core.depth.estimates import RelativeInverseDepth
from iibr_core.formats.images.lif import SOURCE_IMAGE, read_lif


def leia_estimate(data: bytes) -> RelativeInverseDepth | None:
    """White is near; scale and offset stay unknown. None where a JPEG's bytes hold no such map.

    Raises InputError where it is damaged.
    """
    leia = read_lif(BytesIO(data))
    view = next((view for view in leia.views if view.image == SOURCE_IMAGE), None) if leia is not None else None
    if leia is None or view is None or view.inverse_depth is None:
        return None
    first, length = leia.fields[view.inverse_depth]
    return RelativeInverseDepth(decode_map(data[first : first + length], "Leia's map of inverse depth"))
