"""What a user says about a glossy surface: where it is, how it reflects, and what light falls on it. Frozen records.

Directions are in the camera's axes: x right, y down, z away from the viewer.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, isfinite, radians, sin

from iibr_core.types import InputError

Triple = tuple[float, float, float]

MOST_LIGHT = 100.0
LIGHT_RADIUS_LIMITS_DEG = (0.1, 45.0)
MOST_TOLERANCE = 1.75
"""The farthest that two colours are apart, about: black and white."""
STROKE_RADIUS_LIMITS = (0.002, 0.5)
MOST_POINTS = 10_000
"""Of one stroke."""


@dataclass(frozen=True)
class GlossStroke:
    """A stroke of the brush that marks the surface, or takes it out where `erases`.

    points: (x, y) as shares of the photo's width and height. radius: as a share of the photo's width.
    """

    points: tuple[tuple[float, float], ...]
    radius: float
    erases: bool = False


@dataclass(frozen=True)
class GlossSurface:
    """Which part of the photo is glossy: what lies in a range of depth and is near to a colour, then strokes in turn.

    farthest, nearest: shares of the scene's disparity range, 0 = far end, 1 = near end. color: sRGB-encoded; None where
    every colour counts. tolerance: how far from it a colour may be, root of the summed squares. strokes_only: nothing
    but what strokes mark.
    """

    farthest: float = 0.0
    nearest: float = 1.0
    color: Triple | None = None
    tolerance: float = 0.25
    strokes: tuple[GlossStroke, ...] = ()
    strokes_only: bool = False


@dataclass(frozen=True)
class GlossLight:
    """A round light so far away that its rays are parallel. direction: towards it, of any length but 0. color: linear;
    (1, 1, 1) makes white paper that faces it as bright as the photo's white, black is no light. radius_deg: how large
    it is seen, half its width (the sun: 0.27).
    """

    direction: Triple = (-0.4, -0.6, -0.7)
    color: Triple = (1.0, 1.0, 1.0)
    radius_deg: float = 3.0

    @property
    def unit_direction(self) -> Triple:
        """Towards it, of length 1."""
        length = hypot(*self.direction)
        x, y, z = self.direction
        return x / length, y / length, z / length

    @property
    def radiance(self) -> Triple:
        """Of its disc, linear, 1 = the photo's white: what a perfect mirror shows of it."""
        red, green, blue = (value / sin(radians(self.radius_deg)) ** 2 for value in self.color)
        return red, green, blue


@dataclass(frozen=True)
class Gloss:
    """A glossy surface under a light.

    roughness: 0 = mirror, 1 = dull; GGX's alpha is its square (Burley 2012). reflectance: of light that falls in
    straight (F0): 0.04 for plastics and varnish, 0.5 to 1 for metals. environment: path of a picture all around
    (equirectangular, its middle where the camera looks) that is reflected too, "" without. photo_shines: the photo
    already shows what the surface reflects; that part moves as reflections do.
    """

    surface: GlossSurface = GlossSurface()
    roughness: float = 0.3
    reflectance: float = 0.04
    light: GlossLight = GlossLight()
    environment: str = ""
    photo_shines: bool = False

    @property
    def lobe_widths(self) -> tuple[float, float]:
        """(squared width of the lobe, squared sine of the light's radius): what the lobe's shape depends on.

        A disc of radius r under a mirror is a lobe of width r / 2, as far as its peak goes; roughness and disc add up
        as the variances of independent slopes do.
        """
        disc = sin(radians(self.light.radius_deg)) ** 2
        return self.roughness**4 + disc / 4, disc


USUAL = Gloss()


def of_maps(gloss: Gloss) -> Gloss:
    """What of a gloss its maps depend on: two that agree in it differ by uniforms only."""
    if gloss.photo_shines:
        return gloss
    roughness = gloss.roughness if gloss.environment else USUAL.roughness
    return Gloss(gloss.surface, roughness, environment=gloss.environment)


def require_sound(gloss: Gloss) -> None:
    """Raise InputError where a value makes no sense; the message names it."""
    surface, light = gloss.surface, gloss.light
    checks = [
        ("roughness", gloss.roughness, (0.0, 1.0)),
        ("reflectance", gloss.reflectance, (0.0, 1.0)),
        ("surface.farthest", surface.farthest, (0.0, 1.0)),
        ("surface.nearest", surface.nearest, (surface.farthest, 1.0)),
        ("surface.tolerance", surface.tolerance, (0.0, MOST_TOLERANCE)),
        ("light.radius_deg", light.radius_deg, LIGHT_RADIUS_LIMITS_DEG),
    ]
    checks += [("light.color", value, (0.0, MOST_LIGHT)) for value in light.color]
    checks += [("surface.color", value, (0.0, 1.0)) for value in surface.color or ()]
    for stroke in surface.strokes:
        if not 1 <= len(stroke.points) <= MOST_POINTS:
            raise InputError(f"gloss: a stroke of {len(stroke.points)} points; give 1 to {MOST_POINTS}")
        checks.append(("surface.strokes.radius", stroke.radius, STROKE_RADIUS_LIMITS))
        checks += [("surface.strokes.points", at, (-1.0, 2.0)) for point in stroke.points for at in point]
    for name, value, (low, high) in checks:
        if not (isfinite(value) and low <= value <= high):
            raise InputError(f"gloss: {name} is {value:g}; give a number from {low:g} to {high:g}")
    if not 0 < hypot(*light.direction) < float("inf"):
        raise InputError(f"gloss: light.direction is {light.direction}; give x, y, z that are finite and not all 0")
