"""Choices about the lens, by the words of the command line and of `LightField.refocus`, and the optics they lead to."""

import math
from dataclasses import dataclass, replace
from typing import Any

from iibr_core.beyond.optics import (
    HIGHLIGHT_GAIN,
    HIGHLIGHT_STOPS,
    PINHOLE,
    RING_INNER_LIMIT,
    ApertureKind,
    ApertureMask,
    ApertureShape,
    Optics,
)
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.f_numbers import aperture_of
from iibr_core.scenes.lens_limits import BLADES_LIMITS, clamp_optics, first_aperture
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import FloatImage, InputError, ViewOffset

MIN_F_NUMBER = 0.1
LENS_LIMITS: dict[str, tuple[float, float]] = {
    "aperture": (0.0, math.inf),
    "f_number": (MIN_F_NUMBER, math.inf),
    "focus_range": (0.0, math.inf),
    "blades": BLADES_LIMITS,
    "roundness": (0.0, 1.0),
    "ring": (0.0, RING_INNER_LIMIT),
    "cat_eye": (0.0, 1.0),
    "highlights": (0.0, HIGHLIGHT_STOPS),
}
"""Least and greatest value of each number, whatever the scene."""
TURNED: tuple[ApertureKind, ...] = ("polygon", "mask")
"""Shapes that a rotation changes."""


@dataclass(frozen=True)
class LensChoice:
    """Choices about the lens before a scene is open, as in `Optics`; None for the usual value.

    focus_at: place (x, y) of the photo that is in focus, in pixels of its own size. f_number: of a full-frame lens, as
    the window shows it. highlights: stops by which clipped light is brighter than white. blades, ring, cat_eye, mask:
    the shape of the aperture and its number, see `ApertureShape`; one of them. roundness: of the sides between blades.
    rotation: of a polygon or mask, in degrees. Raises InputError for numbers out of range and choices at odds.
    """

    eye: ViewOffset | None = None
    focus: float | None = None
    aperture: float | None = None
    gloss: Gloss | None = None
    focus_at: tuple[float, float] | None = None
    f_number: float | None = None
    focus_range: float | None = None
    tilt: tuple[float, float] | None = None
    highlights: float | None = None
    blades: int | None = None
    roundness: float | None = None
    rotation: float | None = None
    ring: float | None = None
    cat_eye: float | None = None
    mask: ApertureMask | None = None

    def __post_init__(self) -> None:
        for name, (low, high) in LENS_LIMITS.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                limits = f"{low:g} or more" if math.isinf(high) else f"{low:g} to {high:g}"
                raise InputError(f"{_words(name)} {value:g}: give {limits}")
        places = (self.focus_at or (), self.tilt or (), (self.focus or 0.0, self.rotation or 0.0))
        if not all(math.isfinite(number) for numbers in places for number in numbers):
            raise InputError("focus, tilt and rotation are finite numbers: give others")
        for pair in (("focus", "focus_at"), ("aperture", "f_number")):
            if all(getattr(self, name) is not None for name in pair):
                raise InputError(f"{' and '.join(map(_words, pair))}: give one of both")
        if len(self._kinds) > 1:
            raise InputError("blades, ring, cat's eye and mask: give one of them")

    @property
    def _kinds(self) -> list[ApertureKind]:
        """The shapes that are chosen."""
        chosen: dict[ApertureKind, Any] = {
            "polygon": self.blades,
            "ring": self.ring,
            "cat_eye": self.cat_eye,
            "mask": self.mask,
        }
        return [kind for kind, value in chosen.items() if value is not None]

    def shape_on(self, shape: ApertureShape) -> ApertureShape:
        """Return the chosen shape. shape: gives the other numbers. Raises InputError for useless numbers."""
        kind = next(iter(self._kinds), shape.kind)
        if self.rotation is not None and kind not in TURNED:
            raise InputError(f"rotation {self.rotation:g}: turns blades or a mask; give one of them, or leave it out")
        if self.roundness is not None and kind != "polygon":
            raise InputError(f"roundness {self.roundness:g}: bends the sides between blades; give blades too")
        chosen: dict[str, Any] = {
            "blades": self.blades,
            "roundness": self.roundness,
            "rotation_deg": self.rotation,
            "ring_inner": self.ring,
            "cat_eye": self.cat_eye,
            "mask": self.mask,
        }
        return replace(shape, kind=kind, **_given(chosen))

    def wanted_on(self, scene: Scene, disparity: FloatImage | None = None, optics: Optics = PINHOLE) -> Optics:
        """Return the chosen optics, whatever the scene allows; see `optics_on`."""
        focus = self.focus if self.focus_at is None else _disparity_at(self.focus_at, scene, disparity)
        aperture = self.aperture
        if self.f_number is not None:
            aperture = aperture_of(scene, self.f_number)
            if aperture is None:
                raise InputError(f"f/{self.f_number:g}: {scene.name} has no depth; give an aperture in view steps")
        if aperture is None and focus is not None and optics.aperture_diameter == 0:
            aperture = first_aperture(scene)
        chosen: dict[str, Any] = {
            "eye": self.eye,
            "focus_disparity": focus,
            "aperture_diameter": aperture,
            "gloss": self.gloss,
            "focus_range": self.focus_range,
            "focus_tilt": self.tilt,
            "highlight_recovery": None if self.highlights is None else (2**self.highlights - 1) / HIGHLIGHT_GAIN,
        }
        return replace(optics, aperture_shape=self.shape_on(optics.aperture_shape), **_given(chosen))

    def optics_on(self, scene: Scene, disparity: FloatImage | None = None, optics: Optics = PINHOLE) -> Optics:
        """Return the optics as near to the choices as the scene allows; a focus opens a pinhole a little.

        disparity (H, W): of the centre view, needed for `focus_at`. optics: give the other numbers. Raises InputError
        if the scene has no depth for a choice, or no such place, and as `shape_on` does.
        """
        return clamp_optics(self.wanted_on(scene, disparity, optics), scene)

    def notes(self, optics: Optics, scene: Scene) -> tuple[str, ...]:
        """Return a sentence for each choice that changes nothing in a picture with these optics."""
        shaped = _given({"focus range": self.focus_range, "tilt": self.tilt, "shape": self._kinds or None})
        names = " and ".join((*shaped, *(("highlights",) if self.highlights else ())))
        if names and optics.aperture_diameter == 0:
            return (f"A closed lens shows nothing of {names}; open it by an f-number or an aperture.",)
        if self.highlights and scene.is_hdr:
            return (f"{scene.name} is an HDR photo, which has its highlights: no other light is added.",)
        return ()


def _given(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def _words(name: str) -> str:
    """Return the name of a choice as words."""
    return {"f_number": "f-number", "cat_eye": "cat's eye"}.get(name, name.replace("_", " "))


def _disparity_at(place: tuple[float, float], scene: Scene, disparity: FloatImage | None) -> float:
    """Return the disparity at a place of the photo, in pixels of its own size. Raises InputError without one."""
    (x, y), (width, height) = place, require_inside(place, scene)
    if disparity is None:
        raise InputError(f"focus at {x:g},{y:g}: {scene.name} has no depth; give a disparity in focus")
    return float(disparity[int(y * scene.height / height), int(x * scene.width / width)])


def require_inside(place: tuple[float, float], scene: Scene) -> ScreenSize:
    """Return the photo's own size. Raises InputError for a place (x, y) outside it, in its pixels."""
    (x, y), size = place, scene.own_size or scene.size
    if not (0 <= x < size.width and 0 <= y < size.height):
        limits = f"x below {size.width} and y below {size.height}"
        raise InputError(f"{x:g},{y:g}: lies outside the picture; give {limits}")
    return size
