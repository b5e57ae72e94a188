"""Random scenes to learn from: layers of slanted planes, boxes, balls, wires, meshes and leaves before a background.

`raycast` shows them from any view, with exact colours and disparities.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import linear_from_srgb
from iibr_core.training.distributions import log_uniform
from iibr_core.training.scenes.primitives import BALL, BOX, PLANE, PRIMITIVE, WIRE
from iibr_core.training.scenes.raycast import RaycastScene
from iibr_core.training.scenes.textures import DISC, FRAME, LACE, LEAVES, MESH, PATTERNS, WHOLE
from iibr_core.types import ImageSize

OBJECTS = (3, 60)
DEPTH_RATIO = (1.25, 5.0)
"""Greatest against least depth of a scene."""
FOCAL_WIDTHS = (0.8, 2.0)
THINNEST = 1e-9
WITHOUT_END = np.array([1e9, 1e9, THINNEST])
"""Half extents of a plane."""

Primitive = NDArray[np.void]
Vector = NDArray[np.float64]


def random_scene(rng: np.random.Generator, size: ImageSize, largest_disparity: float) -> RaycastScene:
    """A scene for pictures of (height, width); none of its disparities, in any view, exceeds +-largest_disparity.

    largest_disparity: px per view step, the limit on one side of the zero plane; on the other it is some part of it.
    """
    bounds = _random_bounds(rng, size, largest_disparity)
    primitives = _backdrop_planes(bounds)
    if largest_disparity > 0:
        makers = rng.choice(len(MAKERS), int(log_uniform(rng, *OBJECTS)), p=MAKER_SHARES)
        for maker in makers:
            primitives += MAKERS[maker](bounds)
    kept = sorted(primitives, key=lambda p: float(p["nearest_z"]))
    light = rng.normal(size=3) * (1.0, 0.4, 0.4) + (0.0, -1.0, -1.0)
    light /= np.linalg.norm(light)
    return RaycastScene(
        primitives=np.array([*kept, _last_plane(bounds)], PRIMITIVE),
        centre_px=bounds.centre_px,
        focal_px=bounds.focal_px,
        infinity_px=bounds.infinity_px,
        depths=(bounds.least_z, bounds.greatest_z),
        light=(float(light[0]), float(light[1]), float(light[2])),
        ambient=float(rng.uniform(0.4, 0.9)),
    )


@dataclass(frozen=True, eq=False)
class _SceneBounds:
    """The space for objects: a picture, its lens, a range of disparities; and the hues that they share."""

    rng: np.random.Generator
    size: ImageSize
    focal_px: float
    infinity_px: float
    least: float
    greatest: float
    hues: Vector

    @property
    def centre_px(self) -> tuple[float, float]:
        return (self.size.width - 1) / 2, (self.size.height - 1) / 2

    @property
    def least_z(self) -> float:
        return self.depth(self.greatest)

    @property
    def greatest_z(self) -> float:
        return self.depth(self.least)

    @property
    def side_px(self) -> float:
        return float(max(self.size))

    def depth(self, disparity: float) -> float:
        return self.focal_px / (disparity + self.infinity_px)

    def point(self, x: float, y: float, disparity: float) -> Vector:
        """World position of what the centre view sees at (x, y)."""
        z = self.depth(disparity)
        return np.array([(x - self.centre_px[0]) * z / self.focal_px, (y - self.centre_px[1]) * z / self.focal_px, z])

    def somewhere(self) -> Vector:
        """A random point in the frame, or a little outside, equally often at every disparity."""
        height, width = self.size
        x, y = self.rng.uniform(-0.1, 1.1, 2) * (width, height)
        return self.point(x, y, self.rng.uniform(self.least, self.greatest))


def _random_bounds(rng: np.random.Generator, size: ImageSize, largest: float) -> _SceneBounds:
    other = largest * min(float(rng.uniform(-0.1, 1.0)), 1.0)
    least, greatest = (-max(other, 0.0), largest) if rng.random() < 0.75 else (-largest, max(other, 0.0))
    span = max(greatest - least, 1e-3)
    infinity = span / (log_uniform(rng, *DEPTH_RATIO) - 1) - least
    focal = max(size) * float(rng.uniform(*FOCAL_WIDTHS))
    return _SceneBounds(rng, size, focal, infinity, least, greatest, rng.random(5))


def _turn(rng: np.random.Generator, slant: float | None = None) -> NDArray[np.float64]:
    """(3, 3): random orthonormal axes as rows; with a slant, the third leans that much (radians) from the z axis."""
    if slant is None:
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        return axes
    towards, roll = rng.uniform(0, 2 * pi, 2)
    third = np.array([np.sin(slant) * np.cos(towards), np.sin(slant) * np.sin(towards), np.cos(slant)])
    return _axes_about(third, roll)


def _axes_about(third: Vector, roll: float) -> NDArray[np.float64]:
    """(3, 3): orthonormal axes as rows, the third one given, the others turned about it by roll."""
    aside = np.array([0.0, 1.0, 0.0]) if abs(third[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    first = np.cross(aside, third)
    first /= np.linalg.norm(first)
    second = np.cross(third, first)
    return np.stack([np.cos(roll) * first + np.sin(roll) * second, np.cos(roll) * second - np.sin(roll) * first, third])


def _paint(bounds: _SceneBounds, shape: int, centre: Vector, axes: NDArray[np.float64], half: Vector) -> Primitive:
    """A primitive with a random pattern in random colours, as fine as pixels and as coarse as the picture."""
    rng = bounds.rng
    pixel = centre[2] / bounds.focal_px
    p = np.zeros((), PRIMITIVE)
    p["shape"], p["centre"], p["axes"], p["half"] = shape, centre, axes, np.maximum(half, THINNEST)
    reach = np.abs(p["axes"][:, 2]) @ p["half"]
    p["nearest_z"] = max(centre[2] - reach, bounds.least_z)
    p["pattern"] = rng.choice(PATTERNS, p=(0.5, 0.15, 0.12, 0.1, 0.13))
    p["period"] = pixel * log_uniform(rng, 3.0, max(bounds.side_px / 6, 12.0))
    p["roughness"] = rng.beta(1.2, 1.2)
    p["wavelength"] = pixel * log_uniform(rng, 12.0, max(bounds.side_px / 2, 48.0))
    p["gain"] = rng.uniform(0.5, 0.9)
    p["tint"] = rng.beta(1.0, 2.0)
    p["phase"] = rng.uniform(-1e3, 1e3, 3) * pixel
    p["palette"] = _palette(bounds)
    p["seed"] = rng.integers(1 << 31)
    return p


def _palette(bounds: _SceneBounds) -> NDArray[np.float32]:
    """(3, 3): a dark and a light colour of one hue, and a third, linear light."""
    rng = bounds.rng
    hues = rng.choice(bounds.hues, 2) + rng.normal(0, 0.04, 2)
    middle, contrast = rng.uniform(0.2, 0.85), log_uniform(rng, 0.2, 1.4)
    values = np.clip([middle - contrast / 2, middle + contrast / 2, rng.uniform(0.1, 0.9)], 0.03, 0.97)
    saturations = rng.beta(1.0, 3.0, 3)
    phases = (np.array([hues[0], hues[0] + rng.normal(0, 0.05), hues[1]])[:, None] + np.array([0, 2, 1]) / 3) % 1.0
    pure = np.clip(np.abs(6 * phases - 3) - 1, 0, 1)
    return linear_from_srgb(values[:, None] * (1 - saturations[:, None] * (1 - pure)))


def _fit_into_depths(
    bounds: _SceneBounds, shape: int, centre: Vector, axes: NDArray[np.float64], half: Vector
) -> Primitive:
    """The same, shrunk and moved along its line of sight so that it stays within the scene's depths."""
    reach = float(np.abs(axes[:, 2]) @ half)
    room = (bounds.greatest_z - bounds.least_z) / 2
    if reach > 0.99 * room:
        half, reach = half * (0.99 * room / reach), 0.99 * room
    z = min(max(centre[2], bounds.least_z + 1.001 * reach), bounds.greatest_z - 1.001 * reach)
    return _paint(bounds, shape, centre * (z / centre[2]), axes, half)


def _last_plane(bounds: _SceneBounds) -> Primitive:
    return _paint(bounds, PLANE, np.array([0.0, 0.0, bounds.greatest_z]), np.eye(3), WITHOUT_END)


def _backdrop_planes(bounds: _SceneBounds) -> list[Primitive]:
    """Slanted background, floors and walls: up to three planes that cross the whole picture, or none."""
    if bounds.least == bounds.greatest:
        return []
    return [_crossing_plane(bounds) for _ in range(bounds.rng.choice(4, p=(0.25, 0.4, 0.25, 0.1)))]


def _crossing_plane(bounds: _SceneBounds) -> Primitive:
    """A plane without end whose disparity runs from one value to another across the picture."""
    rng = bounds.rng
    towards = rng.uniform(0, 2 * pi) if rng.random() < 0.4 else pi / 2 + rng.normal(0, 0.15)
    direction = np.array([np.cos(towards), np.sin(towards)])
    low = bounds.least + (bounds.greatest - bounds.least) * rng.uniform(-0.6, 0.4)
    high = low + (bounds.greatest - bounds.least) * rng.uniform(0.1, 1.0)
    high = min(high, bounds.greatest - 0.1 * (bounds.greatest - low))
    # focal / z = middle + slope . (x, y) is a plane of the world.
    slope = direction * (high - low) / bounds.side_px
    middle = max((low + high) / 2 + bounds.infinity_px, 0.02 * (bounds.greatest + bounds.infinity_px))
    third = np.array([slope[0] * bounds.focal_px, slope[1] * bounds.focal_px, middle])
    third /= np.linalg.norm(third)
    centre = np.array([0.0, 0.0, bounds.focal_px / middle])
    plane = _paint(bounds, PLANE, centre, _axes_about(third, rng.uniform(0, 2 * pi)), WITHOUT_END)
    plane["nearest_z"] = bounds.least_z
    return plane


def _plane(bounds: _SceneBounds, cut: int = WHOLE, smallest_px: float = 6.0) -> list[Primitive]:
    """A rectangle, a third of the time facing the cameras, else at any slant."""
    rng = bounds.rng
    centre = bounds.somewhere()
    slant = 0.0 if rng.random() < 0.35 else np.arccos(rng.uniform(0.1, 1.0))
    size = log_uniform(rng, smallest_px, max(bounds.side_px * 0.8, smallest_px + 1)) * centre[2] / bounds.focal_px
    half = np.array([size / 2, size / 2 * log_uniform(rng, 0.25, 1.0), 0.0])
    plane = _fit_into_depths(bounds, PLANE, centre, _turn(rng, slant), half)
    plane["cut"] = cut
    return [plane]


def _cut_plane(bounds: _SceneBounds) -> list[Primitive]:
    """A disc, a window frame or ragged lace."""
    rng = bounds.rng
    [plane] = _plane(bounds, int(rng.choice([DISC, FRAME, LACE])), 12.0)
    pixel = plane["centre"][2] / bounds.focal_px
    plane["cut_period"] = log_uniform(rng, 5, 40) * pixel
    plane["cut_width"] = log_uniform(rng, 1, 12) * pixel
    return [plane]


def _mesh(bounds: _SceneBounds) -> list[Primitive]:
    """Wires about a pixel wide in both directions of a plane."""
    rng = bounds.rng
    [plane] = _plane(bounds, MESH, 30.0)
    pixel = plane["centre"][2] / bounds.focal_px
    plane["cut_width"] = log_uniform(rng, 0.7, 2.0) * pixel
    plane["cut_period"] = log_uniform(rng, 5, 24) * pixel
    return [plane]


def _leaves(bounds: _SceneBounds) -> list[Primitive]:
    """A few layers of leaves, one behind the other."""
    rng = bounds.rng
    [first] = _plane(bounds, LEAVES, 40.0)
    pixel = first["centre"][2] / bounds.focal_px
    first["cut_period"] = log_uniform(rng, 10, 50) * pixel
    layers = [first]
    for _ in range(rng.integers(1, 4)):
        layer = _fit_into_depths(bounds, PLANE, first["centre"] * rng.uniform(0.9, 1.1), first["axes"], first["half"])
        for name in ("pattern", "palette", "wavelength", "period", "cut", "cut_period"):
            layer[name] = first[name]
        layer["palette"] *= rng.uniform(0.6, 1.0)
        layers.append(layer)
    return layers


def _box(bounds: _SceneBounds) -> list[Primitive]:
    rng = bounds.rng
    centre = bounds.somewhere()
    size = log_uniform(rng, 5.0, max(bounds.side_px * 0.4, 6.0)) * centre[2] / bounds.focal_px
    return [_fit_into_depths(bounds, BOX, centre, _turn(rng), size / 2 * rng.uniform(0.3, 1.0, 3))]


def _ball(bounds: _SceneBounds) -> list[Primitive]:
    rng = bounds.rng
    centre = bounds.somewhere()
    size = log_uniform(rng, 4.0, max(bounds.side_px * 0.4, 5.0)) * centre[2] / bounds.focal_px
    half = np.full(3, size / 2) if rng.random() < 0.5 else size / 2 * rng.uniform(0.3, 1.0, 3)
    return [_fit_into_depths(bounds, BALL, centre, _turn(rng), half)]


def _wires(bounds: _SceneBounds) -> list[Primitive]:
    """One to five wires, each about a pixel wide; several run side by side."""
    rng = bounds.rng
    centre = bounds.somewhere()
    pixel = centre[2] / bounds.focal_px
    axes = _turn(rng, pi / 2 + float(rng.normal(0, 0.25)))
    radius = log_uniform(rng, 0.35, 1.2) * pixel
    length = log_uniform(rng, 10.0, max(bounds.side_px * 1.5, 11.0)) * pixel
    apart = axes[0] * log_uniform(rng, 4, 20) * pixel
    half = np.array([radius, radius, length / 2])
    return [_fit_into_depths(bounds, WIRE, centre + k * apart, axes, half) for k in range(rng.integers(1, 6))]


MAKERS: list[Callable[[_SceneBounds], list[Primitive]]] = [_plane, _cut_plane, _mesh, _leaves, _box, _ball, _wires]
MAKER_SHARES = (0.28, 0.12, 0.07, 0.12, 0.17, 0.12, 0.12)
