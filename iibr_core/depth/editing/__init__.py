"""What a user does to a map: tone, clips, a brush.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.depth.editing.canvas import DepthCanvas
    from iibr_core.depth.editing.edits import (
        BRUSH_TOOLS,
        DEPTH_TOOLS,
        GAMMA_LIMITS,
        MOST_POINTS,
        RADIUS_LIMITS,
        UNEDITED,
        BrushTool,
        DepthEdits,
        Levels,
        Stroke,
        invert_tone_curve,
        require_sound,
        tone_curve,
    )
else:
    __getattr__ = offered_by(__file__)
