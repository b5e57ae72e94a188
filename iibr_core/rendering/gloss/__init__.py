"""Simulated specularity: a surface of the photo made glossy under a given light (the paper's section of that name).

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.rendering.gloss.gloss_settings import (
        LIGHT_RADIUS_LIMITS_DEG,
        MOST_POINTS,
        MOST_TOLERANCE,
        STROKE_RADIUS_LIMITS,
        Gloss,
        GlossLight,
        GlossStroke,
        GlossSurface,
        Triple,
        require_sound,
    )
    from iibr_core.rendering.gloss.shading import GlossMaps
else:
    __getattr__ = offered_by(__file__)
