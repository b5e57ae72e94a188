"""Options of the lens."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.beyond.optics import Optics
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.lens_limits import LensChoice, eye_limits
from iibr_core.scenes.scene import Scene
from iibr_core.types import InputError, ViewOffset
from viewer.cli.options import number_from_text, view_from_text

GlossFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Make a surface glossy: a TOML file with roughness, reflectance, \\[surface] and \\[light].",
        show_default=False,
    ),
]


@dataclass(frozen=True)
class LensOptions:
    """Values of the options of the lens, None if an option is not given."""

    view: Annotated[
        ViewOffset | None,
        typer.Option(
            parser=view_from_text, metavar="S,T", help="Viewpoint in view steps, right and down.", show_default="0,0"
        ),
    ] = None
    focus: Annotated[
        float | None,
        typer.Option(
            parser=number_from_text,
            metavar="X",
            help="Disparity in focus, px per view step (Focus in the panel); it lies in the plane of a 3D display.",
        ),
    ] = None
    aperture: Annotated[float | None, typer.Option(min=0, metavar="X", help="Aperture diameter in view steps.")] = None
    gloss: GlossFile = None

    def choice(self) -> LensChoice:
        """Return the same for the core. Raises InputError if the gloss cannot be read."""
        return LensChoice(self.view, self.focus, self.aperture, gloss_of(self.gloss))

    def require_within(self, scene: Scene) -> None:
        """Raise InputError for a viewpoint outside the scene's views; a single view shows every viewpoint."""
        if self.view is None or scene.grid == (1, 1):
            return
        for axis, value, views in (("S", self.view.s, scene.grid.columns), ("T", self.view.t, scene.grid.rows)):
            low, high = eye_limits(views)
            if not low <= value <= high:
                raise InputError(f"--view: {axis} is {value:g}; {scene.name} has {low:g} to {high:g}")

    def notes(self, optics: Optics) -> tuple[str, ...]:
        """Return a note for each value that the scene limits."""
        asked = (
            ("--focus", self.focus, optics.focus_disparity),
            ("--aperture", self.aperture, optics.aperture_diameter),
        )
        return tuple(
            f"{option} {value:g} exceeds what the scene has; {used:g} is used."
            for option, value, used in asked
            if value is not None and value != used
        )


def gloss_of(path: Path | None) -> Gloss | None:
    """Return the gloss that a file describes. Raises InputError."""
    if path is None:
        return None
    from viewer.model.gloss_file import read_gloss  # imports msgspec

    return read_gloss(path)
