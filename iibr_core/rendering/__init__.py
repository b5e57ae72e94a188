"""One view from the ray set.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.rendering.aperture_sampling import (
        SQRT_STEPS,
        Points,
        aperture_points,
        fractions,
        grid_weights,
        open_area,
    )
    from iibr_core.rendering.large_views import LargePhoto
    from iibr_core.rendering.optics import (
        APERTURE_KINDS,
        CENTRE,
        EXPOSURE_LIMIT_STOPS,
        RING_INNER_LIMIT,
        ApertureKind,
        ApertureMask,
        ApertureShape,
        Optics,
    )
    from iibr_core.rendering.ray_set import RaySet
    from iibr_core.rendering.renderer import open_renderer
else:
    __getattr__ = offered_by(__file__)
