"""Numbers that decide how finely pictures through a lens are drawn, in the window and in web pages."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from iibr_core.beyond import aperture_sampling

FIRST_SPACING_PX = 6.5
"""Blur, in output pixels, for which the first pass has one more camera."""

MIN_PASS, MAX_PASS = 4, 12
"""Smallest and largest number of cameras of a pass."""

CAMERAS_PER_PX = 4.0
"""Cameras of a finished picture for each output pixel of its widest blur: an edge then turns into a smooth ramp."""

MIN_CAMERAS, MAX_CAMERAS = 64, 144
"""Smallest and largest number of cameras of a finished picture; between views, that many blend them smoothly, too."""

EDGE_PASSES = 5
"""Passes that make the edges of a warped pinhole view smooth."""

BLEND_POINTS = 1024
"""Points of the aperture that weigh views without disparity."""

MAX_SOURCES = 4
"""Largest number of stored views that answer a pinhole."""

MIN_WEIGHT = 2e-4
"""Smallest weight of a view that is drawn; a smaller weight changes white by a twentieth of an 8-bit step."""

MAX_SAMPLES = 256
"""Largest number of samples of a draw, as in shaders/lens.frag; more samples take several draws."""

OFF_BORDER_PX = 1 / 256
"""Shift of a camera's place in its pixel: halfway between views, look-ups would lie on the border of two texels."""

NEAR_PX = 32.0
"""Largest parallax between a camera and its view at which three steps find the surface, see first_hit.glsl."""

ALONE_NEAR_PX = 2.0
"""The same limit for a single view."""


@dataclass(frozen=True)
class QualityLevel:
    """Limits of a picture.

    cameras: share of a pass's cameras in the aperture. sources: largest number of stored views that answer a pinhole.
    scale: share of the picture's width and height.
    """

    cameras: float = 1.0
    sources: int = MAX_SOURCES
    scale: float = 1.0


BEST_QUALITY = QualityLevel()
QUALITY_LEVELS = (
    BEST_QUALITY,
    QualityLevel(1.0, 2),
    QualityLevel(1.0, 1),
    QualityLevel(1.0, 1, 0.7),
    QualityLevel(1.0, 1, 0.5),
    QualityLevel(1.0, 1, 0.35),
    QualityLevel(0.5, 1, 0.35),
)
"""Quality levels from the best to the fastest. At equal cost, half the width is nearer to the converged picture than a
quarter of the cameras.
"""

SAMPLING_NUMBERS = "GRID_SIDE EDGE GOLDEN_ANGLE TURN_STEP SHIFT_STEP SQRT_STEPS COARSENESS_VARIANCE"


def page_numbers() -> dict[str, Any]:
    """Return the numbers that `web/renderer.js` needs, by name."""
    sampling = {name: getattr(aperture_sampling, name) for name in SAMPLING_NUMBERS.split()}
    numbers = {name: value for name, value in globals().items() if name.isupper() and isinstance(value, int | float)}
    return {**numbers, **sampling, "LEVELS": [asdict(level) for level in QUALITY_LEVELS]}
