"""What is known of a photo's depth before it is disparity for a grid of views. The three kinds differ by type, so that
none is ever taken for another. In all of them NaN is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.types import FloatImage


@dataclass(frozen=True, eq=False)
class RelativeInverseDepth:
    """Inverse depth up to an unknown scale (> 0) and offset: larger is closer, nothing else is said.

    values: (H, W) float32.
    """

    values: FloatImage


@dataclass(frozen=True, eq=False)
class MetricDepth:
    """Distance from the camera.

    metres: (H, W) float32, positive.
    """

    metres: FloatImage


@dataclass(frozen=True, eq=False)
class DisparityMap:
    """Disparity that counts as it is: pixels per view step of a picture this large, larger is closer.

    px_per_view: (H, W) float32.
    """

    px_per_view: FloatImage


Estimate = RelativeInverseDepth | MetricDepth | DisparityMap


def values_of(estimate: Estimate) -> FloatImage:
    """Its array (H, W), whatever it means."""
    match estimate:
        case RelativeInverseDepth(values) | MetricDepth(values) | DisparityMap(values):
            return values


def inverted(estimate: Estimate) -> Estimate:
    """The same with near and far swapped: distances become inverse distances."""
    match estimate:
        case RelativeInverseDepth(values):
            return RelativeInverseDepth(-values)
        case MetricDepth(metres):
            return RelativeInverseDepth(metres)
        case DisparityMap(px_per_view):
            return DisparityMap(-px_per_view)
