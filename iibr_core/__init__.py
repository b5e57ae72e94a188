"""Inverse image-based rendering: one photo and its disparity become a 4D light field. No window, no GL.

The public Python interface; docs/python.md shows it by examples. `import iibr_core as iibr` loads nothing but names.
Pictures are (H, W, 3), encoded by sRGB's curve: float32 with 1 = white, or uint8. Disparity is (H, W) float32, larger
is closer. Light fields are (V, U, H, W, ...), v down, u right; their disparity is in px from view to view.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.interface.fields import FORMATS, LightField, View
    from iibr_core.interface.judging import Comparison, compare, evaluate
    from iibr_core.interface.public_scene import Scene, estimate_depth, from_arrays, open
    from iibr_core.runtime.tiling import Cancelled
    from iibr_core.stages import Stages
    from iibr_core.types import InputError
else:
    __getattr__ = offered_by(__file__)

__all__ = [
    "FORMATS", "Cancelled", "Comparison", "InputError", "LightField", "Scene", "Stages", "View", "compare",
    "estimate_depth", "evaluate", "from_arrays", "open",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
