"""Settings of a glossy surface: where it is, how it reflects, and the light that falls on it.

Directions are in the camera's axes: x right, y down, z away from the viewer.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians, sin

Triple = tuple[float, float, float]

LIGHT_RADIUS_LIMITS_DEG = (0.1, 45.0)
MAX_TOLERANCE = 1.75
"""Largest useful colour tolerance, about the distance between black and white."""
STROKE_RADIUS_LIMITS = (0.002, 0.5)
MAX_STROKE_POINTS = 10_000


@dataclass(frozen=True)
class GlossStroke:
    """A brush stroke that marks the surface, or removes a part of it if `erases`.

    points: (x, y) as shares of the photo's width and height. radius: as a share of the photo's width.
    """

    points: tuple[tuple[float, float], ...]
    radius: float
    erases: bool = False


@dataclass(frozen=True)
class GlossSurface:
    """The glossy part of the photo: pixels in a range of depth and near a colour, then strokes in turn.

    farthest, nearest: shares of the scene's disparity range, 0 = far end, 1 = near end. color: sRGB-encoded; None
    allows every colour. tolerance: largest distance from it, root of the summed squares. strokes_only: only strokes
    mark the surface.
    """

    farthest: float = 0.0
    nearest: float = 1.0
    color: Triple | None = None
    tolerance: float = 0.25
    strokes: tuple[GlossStroke, ...] = ()
    strokes_only: bool = False


@dataclass(frozen=True)
class GlossLight:
    """A round light so far away that its rays are parallel.

    direction: towards it, of any length but 0. color: linear; (1, 1, 1) makes white paper that faces the light as
    bright as the photo's white. radius_deg: half its apparent width (the sun: 0.27).
    """

    direction: Triple = (-0.4, -0.6, -0.7)
    color: Triple = (1.0, 1.0, 1.0)
    radius_deg: float = 3.0

    def __post_init__(self) -> None:
        if not any(self.direction):
            raise ValueError("the light's direction is 0, 0, 0; give x, y, z that are not all 0")

    @property
    def unit_direction(self) -> Triple:
        """Direction towards the light, of length 1."""
        length = hypot(*self.direction)
        x, y, z = self.direction
        return x / length, y / length, z / length

    @property
    def radiance(self) -> Triple:
        """Linear radiance of its disc, 1 = the photo's white: what a perfect mirror shows."""
        red, green, blue = (value / sin(radians(self.radius_deg)) ** 2 for value in self.color)
        return red, green, blue


@dataclass(frozen=True)
class Gloss:
    """A glossy surface under a light.

    roughness: 0 = mirror, 1 = dull; GGX's alpha is its square (Burley 2012). reflectance: share of perpendicular light
    that is reflected (F0): 0.04 for plastics and varnish, 0.5 to 1 for metals.
    """

    surface: GlossSurface = GlossSurface()
    roughness: float = 0.3
    reflectance: float = 0.04
    light: GlossLight = GlossLight()

    @property
    def lobe(self) -> Triple:
        """Squared width of the lobe, squared sine of the light's radius, reflectance.

        A disc of radius r under a mirror is a lobe of width r / 2, as far as its peak goes; the variances of roughness
        and disc add up.
        """
        disc = sin(radians(self.light.radius_deg)) ** 2
        return self.roughness**4 + disc / 4, disc, self.reflectance
