"""Switches of the stages between map and view, for `iibr evaluate --without` and the ablation."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace

from iibr_core.types import InputError


@dataclass(frozen=True)
class Stages:
    """The stages, in the order in which they run; True ones are on."""

    sharpen_soft_edges: bool = True
    """Depth edges that a blur made soft become steps at the photo's edges."""
    fit_to_blur: bool = True
    """Sharpened edges of enlarged maps move until, blurred again, they give the map that they came from."""
    refill_between_surfaces: bool = True
    """Lone disparities between two surfaces are filled again by colour."""
    label_edge_bands: bool = True
    """Pixels beside a depth edge, or a defocused boundary, go to the side whose colours they have."""
    outpainting: bool = True
    """The photo is continued beyond its frame, once for all views."""
    outpainted_lines: bool = True
    """Lines continue straight beyond the frame."""
    split_mixed_pixels: bool = True
    """Pixels that show two surfaces become a ray of each."""
    connect_slopes: bool = True
    """Rays of one steep surface stay joined, however far apart they land."""
    leave_out_in_front: bool = True
    """Pixels that were inpainted in front of the photo's surfaces are not added to the rays."""
    share_inpainted: bool = True
    """The inpainted pixels of the outer views are shown by all views."""
    composite_partial_coverage: bool = True
    """Rays that cover a pixel in part are composited over the inpainted background."""
    ray_transformer: bool = True
    """The ray transformer decides rays with several candidate surfaces; without it, the closed form does."""
    reopen_holes: bool = True
    """A hole in one of the photo's surfaces does not show the inpainted background."""
    synthesise_patches: bool = True
    """Inpainted pixels get the texture of their surface from patches."""
    remove_flying_pixels: bool = True
    """Pixels that appear detached from their surface are replaced."""


ALL_STAGES = Stages()
STAGE_NAMES = tuple(stage.name.replace("_", "-") for stage in fields(Stages))
"""Names of the stages on the command line."""


def stages_without(names: Iterable[str]) -> Stages:
    """Return all stages but these. Raises InputError for a name that is not in STAGE_NAMES."""
    left_out = list(names)
    for name in left_out:
        if name not in STAGE_NAMES:
            raise InputError(f"{name!r} is no stage; give one of {', '.join(STAGE_NAMES)}")
    return replace(ALL_STAGES, **{name.replace("-", "_"): False for name in left_out})
