"""Options of commands for the lens."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.gloss.settings import Gloss
from iibr_core.types import InputError, ViewOffset
from viewer.cli.shared_options import not_negative_from_text, number_option, view_from_text
from viewer.model import lens
from viewer.model.action import do

if TYPE_CHECKING:
    from iibr_core.beyond.optics import Optics
    from iibr_core.scenes.lens_limits import LensChoice
    from iibr_core.scenes.scene import Scene
    from viewer.model.action import Action

View = Annotated[
    ViewOffset | None,
    typer.Option(
        parser=view_from_text, metavar="S,T", help="Viewpoint in view steps, right and down.", show_default="0,0"
    ),
]
Focus = Annotated[
    float | None,
    number_option("Disparity that is sharp (the panel's Focus) and lies in a display's screen, px per view step."),
]
Aperture = Annotated[
    float | None, typer.Option(parser=not_negative_from_text, metavar="X", help="Aperture diameter in view steps.")
]


@dataclass(frozen=True)
class GlossOption:
    """A gloss and its file."""

    file: Path
    gloss: Gloss

    @property
    def reads(self) -> tuple[Path, ...]:
        """Files that must not be written onto."""
        return (self.file,)


def gloss_from_text(text: str) -> GlossOption:
    """Return the gloss that a file describes. Raises BadParameter."""
    from viewer.model.gloss_file import read_gloss

    try:
        return GlossOption(Path(text), read_gloss(Path(text)))
    except InputError as error:
        raise typer.BadParameter(str(error)) from None


GlossFile = Annotated[
    GlossOption | None,
    typer.Option(
        "--gloss",
        parser=gloss_from_text,
        metavar="FILE",
        help="Make a surface glossy: a TOML file with roughness, reflectance, \\[surface] and \\[light].",
        show_default=False,
    ),
]


@dataclass(frozen=True)
class LensOptions:
    """Values of the options for the lens, None where an option is not given."""

    view: View = None
    focus: Focus = None
    aperture: Aperture = None
    gloss: GlossFile = None

    @property
    def choice(self) -> LensChoice:
        """The same values for code without a window."""
        from iibr_core.scenes.lens_limits import LensChoice

        return LensChoice(self.view, self.focus, self.aperture, self.gloss.gloss if self.gloss else None)

    def actions(self) -> list[Action]:
        """Return the actions that set the lens."""
        actions: list[Action] = [] if self.view is None else [do(lens.move_eye, self.view)]
        actions += [] if self.focus is None else [do(lens.set_focus, self.focus)]
        actions += [] if self.aperture is None else [do(lens.set_aperture, self.aperture)]
        return actions + ([] if self.gloss is None else [do(lens.set_gloss, self.gloss.gloss)])

    def require_within(self, scene: Scene) -> None:
        """Raise InputError for a viewpoint outside the scene's views; a single view shows every viewpoint."""
        from iibr_core.scenes.lens_limits import eye_limits

        if self.view is None or scene.grid == (1, 1):
            return
        for axis, value, views in (("S", self.view.s, scene.grid.columns), ("T", self.view.t, scene.grid.rows)):
            low, high = eye_limits(views)
            if not low <= value <= high:
                raise InputError(f"--view: {axis} is {value:g}, for {scene.name} it goes from {low:g} to {high:g}")

    def notes(self, optics: Optics) -> tuple[str, ...]:
        """Return a note for each value that the scene limits."""
        asked = (
            ("--focus", self.focus, optics.focus_disparity),
            ("--aperture", self.aperture, optics.aperture_diameter),
        )
        return tuple(
            f"{option} {value:g} is beyond what the scene has: {taken:g} was taken."
            for option, value, taken in asked
            if value is not None and value != taken
        )


NO_LENS_OPTIONS = LensOptions()
