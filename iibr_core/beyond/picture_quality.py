"""Numbers that decide how finely pictures through a lens are drawn, in the window and in web pages."""

from __future__ import annotations

from dataclasses import dataclass

EDGE_PASSES = 5
"""Passes that make the edges of a warped pinhole view smooth."""

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

    sources: largest number of stored views that answer a pinhole. scale: share of the picture's width and height.
    """

    sources: int = MAX_SOURCES
    scale: float = 1.0


BEST_QUALITY = QualityLevel()
QUALITY_LEVELS = (
    BEST_QUALITY,
    QualityLevel(2),
    QualityLevel(1),
    QualityLevel(1, 0.7),
    QualityLevel(1, 0.5),
    QualityLevel(1, 0.35),
)
"""Quality levels from the best to the fastest."""
