"""What a command's options say about the photo that is opened: where its depth comes from, how views are made of it."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError
from viewer.cli.shared_options import (
    DepthFrom,
    DepthModel,
    DepthStrength,
    DisparityFile,
    DisparityScale,
    Inpaint,
    InvertDepth,
    MaxPixels,
    Metric,
    Refine,
    Stretch,
    given_options,
)

if TYPE_CHECKING:
    from iibr_core.scenes.scene import Source


@dataclass(frozen=True)
class PhotoOptions:
    """Of commands that open photos, whichever."""

    depth: DepthFrom = "auto"
    depth_model: DepthModel = None
    refine: Refine = True
    depth_strength: DepthStrength = 1.0
    invert_depth: InvertDepth = False
    metric: Metric = False
    stretch: Stretch = False
    max_pixels: MaxPixels = None
    inpaint: Inpaint = DEFAULT_INPAINTER

    @property
    def depth_choice(self) -> DepthChoice:
        """A model that is named is asked first. Raises InputError where the options contradict each other."""
        if self.depth_model is not None and self.depth not in ("auto", "model"):
            raise InputError(f"--depth {self.depth} asks no model: leave out --depth-model")
        start = self.depth if self.depth_model is None else "model"
        return DepthChoice(
            start,
            inverts=self.invert_depth,
            is_metric=self.metric,
            stretches=self.stretch,
            model=self.depth_model,
            refine=self.refine,
        )

    def source(
        self, path: Path | str, grid: GridShape | None, focus_disparity: float | None = None, is_literal: bool = False
    ) -> Source:
        """What is opened. Raises InputError where the options contradict each other."""
        if is_literal and grid is None:
            raise InputError("--literal counts disparity in px from view to view: say how many with --grid")
        if is_literal and (focus_disparity is not None or self.depth_strength != 1):
            raise InputError(
                "--depth-strength, --focus-disparity: mean nothing to disparity that counts as it is given"
            )
        return Source(str(path), self.depth_choice, grid, focus_disparity, self.max_pixels, self.inpaint, is_literal)


@dataclass(frozen=True)
class SceneOptions(PhotoOptions):
    """Of commands that open one photo or light field: its disparity may be named."""

    disparity: DisparityFile = None
    disparity_scale: DisparityScale = None

    @property
    def depth_choice(self) -> DepthChoice:
        """See `PhotoOptions.depth_choice`."""
        if self.disparity is not None and (self.depth != "auto" or self.depth_model is not None):
            raise InputError("--disparity names the depth already: leave out --depth and --depth-model")
        file = None if self.disparity is None else str(self.disparity)
        return replace(super().depth_choice, file=file, file_scale=self.disparity_scale)


NOT_FOR_LIGHT_FIELDS = {field.name for field in fields(PhotoOptions)} | {"focus_disparity", "grid"}
"""Options about how views are made: a light field brings its own. Its centre view's disparity may be given."""


def require_heeded(context: typer.Context, path: Path, unheeded: AbstractSet[str] = NOT_FOR_LIGHT_FIELDS) -> None:
    """Raise InputError for options given that a light field at `path` would not heed."""
    given = given_options(context)
    # A scale says nothing without the map that it is of.
    given &= unheeded if "disparity" in given else unheeded | {"disparity_scale"}
    if not given or not is_light_field(path):
        return
    options = [parameter.opts[0] for parameter in context.command.params if parameter.name in given]
    raise InputError(
        f"{' and '.join(options)}: {path} is a light field, and its views are taken as they are; leave it out"
    )
