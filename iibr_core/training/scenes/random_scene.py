"""Random scenes: planes, ellipsoids, wires, meshes and lace before slanted walls and floors.

`render` and `cast` (see raycast) show a scene from any view, with exact colours and disparities.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iibr_core.color import linear_from_srgb
from iibr_core.training.distributions import log_uniform
from iibr_core.training.scenes.primitives import DISC, ELLIPSOID, LACE, MESH, PLANE, PRIMITIVE, WHOLE, WIRE
from iibr_core.training.scenes.raycast import RaycastScene, cast, render
from iibr_core.types import ImageSize

__all__ = ["RaycastScene", "cast", "random_scene", "render"]

OBJECTS = 3, 60
DEPTH_RATIO = 1.25, 5.0
"""Range of the greatest depth of a scene divided by the least."""
FOCAL_WIDTHS = 0.8, 2.0
"""Range of focal lengths, in longer sides of the picture."""
ENDLESS = 1e9, 1e9, 0.0
"""Half extents of a plane that fills every view."""

Primitive = NDArray[np.void]
Vector = NDArray[np.float64]


def random_scene(rng: np.random.Generator, size: ImageSize, largest_disparity: float) -> RaycastScene:
    """Return a scene for pictures of a size, with disparities of at most +-largest_disparity px per view step."""
    space = _random_space(rng, size, largest_disparity)
    primitives = [_crossing_plane(space) for _ in range(rng.choice(4, p=(0.25, 0.4, 0.25, 0.1)))]
    for maker in rng.choice(len(MAKERS), int(log_uniform(rng, *OBJECTS)), p=MAKER_SHARES):
        primitives += MAKERS[maker](space)
    backdrop = _paint(space, PLANE, np.array([0.0, 0.0, space.greatest_z]), np.eye(3), ENDLESS)
    light = rng.normal(size=3) * (1.0, 0.4, 0.4) + (0.0, -1.0, -1.0)
    x, y, z = light / np.linalg.norm(light)
    return RaycastScene(
        primitives=np.array([*primitives, backdrop], PRIMITIVE),
        centre_px=space.centre_px,
        focal_px=space.focal_px,
        infinity_px=space.infinity_px,
        depths=(space.least_z, space.greatest_z),
        light=(float(x), float(y), float(z)),
        ambient=rng.uniform(0.4, 0.9),
    )


@dataclass(frozen=True, eq=False)
class _Space:
    """The space of a scene: size of the picture, lens, least and greatest disparity."""

    rng: np.random.Generator
    size: ImageSize
    focal_px: float
    infinity_px: float
    least: float
    greatest: float

    @property
    def centre_px(self) -> tuple[float, float]:
        return (self.size.width - 1) / 2, (self.size.height - 1) / 2

    @property
    def least_z(self) -> float:
        return self.focal_px / (self.greatest + self.infinity_px)

    @property
    def greatest_z(self) -> float:
        return self.focal_px / (self.least + self.infinity_px)

    @property
    def side_px(self) -> float:
        return float(max(self.size))

    def place(self) -> tuple[Vector, float]:
        """Return a random point in the frame, or a little outside, and the size of a pixel there.

        All disparities are equally frequent.
        """
        z = self.focal_px / (self.rng.uniform(self.least, self.greatest) + self.infinity_px)
        x, y = self.rng.uniform(-0.6, 0.6, 2) * (self.size.width, self.size.height) * z / self.focal_px
        return np.array([x, y, z]), z / self.focal_px


def _random_space(rng: np.random.Generator, size: ImageSize, largest: float) -> _Space:
    other = largest * rng.uniform(0.0, 1.0)
    least, greatest = (-other, largest) if rng.random() < 0.75 else (-largest, other)
    infinity = (greatest - least) / (log_uniform(rng, *DEPTH_RATIO) - 1) - least
    return _Space(rng, size, max(size) * rng.uniform(*FOCAL_WIDTHS), infinity, least, greatest)


def _axes(rng: np.random.Generator, direction: ArrayLike) -> NDArray[np.float64]:
    """Return random orthonormal axes as rows, the last along a direction."""
    third = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    first = np.cross(third, rng.normal(size=3))
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third])


def _paint(space: _Space, shape: int, centre: Vector, axes: NDArray[np.float64], half: ArrayLike) -> Primitive:
    """Return a primitive with a random texture, as fine as pixels or as coarse as the picture."""
    rng, pixel = space.rng, centre[2] / space.focal_px
    p = np.zeros((), PRIMITIVE)
    p["shape"], p["centre"], p["axes"], p["half"] = shape, centre, axes, half
    p["wavelength"] = pixel * log_uniform(rng, 10.0, space.side_px / 2)
    p["gain"] = rng.uniform(0.5, 0.9)
    p["stripes"] = rng.beta(1.2, 1.2) if rng.random() < 0.4 else 0.0
    p["period"] = pixel * log_uniform(rng, 3.0, space.side_px / 6)
    p["palette"] = _palette(rng)
    p["seed"] = rng.integers(1 << 31)
    return p


def _palette(rng: np.random.Generator) -> NDArray[np.float32]:
    """Return a dark and a light colour (2, 3) of similar hue, in linear light."""
    middle, contrast = rng.uniform(0.2, 0.85), log_uniform(rng, 0.2, 1.4)
    values = np.clip([middle - contrast / 2, middle + contrast / 2], 0.03, 0.97)
    hue = 1 - rng.beta(1.0, 2.0) * rng.random(3) - rng.uniform(0.0, 0.1, (2, 3))
    return linear_from_srgb((values[:, None] * hue).astype(np.float32))


def _fit(space: _Space, shape: int, centre: Vector, axes: NDArray[np.float64], half: Vector) -> Primitive:
    """Return a primitive that is shrunk, and moved along its line of sight, to stay within the scene's depths."""
    reach, room = float(np.abs(axes[:, 2]) @ half), 0.49 * (space.greatest_z - space.least_z)
    shrink = min(1.0, room / max(reach, 1e-9))
    z = np.clip(centre[2], space.least_z + 1.01 * shrink * reach, space.greatest_z - 1.01 * shrink * reach)
    return _paint(space, shape, centre * (z / centre[2]), axes, shrink * half)


def _crossing_plane(space: _Space) -> Primitive:
    """Return an endless plane, most often a floor, whose disparity changes across the picture."""
    rng, span = space.rng, space.greatest - space.least
    angle = rng.uniform(0, 2 * pi) if rng.random() < 0.4 else pi / 2 + rng.normal(0, 0.15)
    low = space.least + span * rng.uniform(-0.6, 0.4)
    high = min(low + span * rng.uniform(0.1, 1.0), space.greatest - 0.1 * (space.greatest - low))
    # focal / z = middle + slope . (x, y) is a plane of the world.
    slope = (high - low) / space.side_px * space.focal_px
    middle = max((low + high) / 2 + space.infinity_px, 0.02 * (space.greatest + space.infinity_px))
    axes = _axes(rng, [slope * cos(angle), slope * sin(angle), middle])
    return _paint(space, PLANE, np.array([0.0, 0.0, space.focal_px / middle]), axes, ENDLESS)


def _rectangle(space: _Space, cut: int, smallest_px: float) -> Primitive:
    """Return a rectangle that faces the cameras a third of the time, and has any slant otherwise."""
    rng = space.rng
    centre, pixel = space.place()
    angle, cosine = rng.uniform(0, 2 * pi), 1.0 if rng.random() < 0.35 else rng.uniform(0.1, 1.0)
    sine = sqrt(1 - cosine * cosine)
    size = log_uniform(rng, smallest_px, space.side_px * 0.8) * pixel
    half = np.array([size / 2, size / 2 * log_uniform(rng, 0.25, 1.0), 0.0])
    plane = _fit(space, PLANE, centre, _axes(rng, [sine * cos(angle), sine * sin(angle), cosine]), half)
    plane["cut"] = cut
    return plane


def _plane(space: _Space) -> list[Primitive]:
    return [_rectangle(space, WHOLE, 6.0)]


def _disc(space: _Space) -> list[Primitive]:
    return [_rectangle(space, DISC, 12.0)]


def _mesh(space: _Space) -> list[Primitive]:
    """Return wires, about a pixel wide, in both directions of a plane."""
    plane = _rectangle(space, MESH, 30.0)
    pixel = plane["centre"][2] / space.focal_px
    plane["cut_width"] = log_uniform(space.rng, 0.7, 2.0) * pixel
    plane["cut_period"] = log_uniform(space.rng, 5, 24) * pixel
    return [plane]


def _lace(space: _Space) -> list[Primitive]:
    """Return one to four layers of lace of one texture, like leaves of a tree."""
    rng, first = space.rng, _rectangle(space, LACE, 30.0)
    first["cut_period"] = log_uniform(rng, 5, 40) * first["centre"][2] / space.focal_px
    layers = [first]
    for _ in range(rng.integers(0, 4)):
        layer = _fit(space, PLANE, first["centre"] * rng.uniform(0.9, 1.1), first["axes"], first["half"])
        for name in ("cut", "cut_period", "wavelength", "gain", "stripes", "period"):
            layer[name] = first[name]
        layer["palette"] = first["palette"] * rng.uniform(0.6, 1.0)
        layers.append(layer)
    return layers


def _ellipsoid(space: _Space) -> list[Primitive]:
    rng = space.rng
    centre, pixel = space.place()
    size = log_uniform(rng, 4.0, space.side_px * 0.4) * pixel
    return [_fit(space, ELLIPSOID, centre, _axes(rng, rng.normal(size=3)), size / 2 * rng.uniform(0.3, 1.0, 3))]


def _wires(space: _Space) -> list[Primitive]:
    """Return one to five wires side by side, each about a pixel wide."""
    rng = space.rng
    centre, pixel = space.place()
    angle = rng.uniform(0, 2 * pi)
    axes = _axes(rng, [cos(angle), sin(angle), rng.normal(0, 0.25)])
    radius = log_uniform(rng, 0.35, 1.2) * pixel
    half = np.array([radius, radius, log_uniform(rng, 5.0, space.side_px * 0.75) * pixel])
    step = axes[0] * log_uniform(rng, 4, 20) * pixel
    return [_fit(space, WIRE, centre + k * step, axes, half) for k in range(rng.integers(1, 6))]


MAKERS: list[Callable[[_Space], list[Primitive]]] = [_plane, _disc, _mesh, _lace, _ellipsoid, _wires]
MAKER_SHARES = 0.36, 0.07, 0.08, 0.15, 0.2, 0.14
