"""The stages between map and view, each on or off: read by all of them, `iibr evaluate --without` and the ablation."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace

from iibr_core.types import InputError


@dataclass(frozen=True)
class Stages:
    """The stages that are on; all are by default. In the order in which they work."""

    sharpen_soft_edges: bool = True
    """Depth edges that a blur made soft become steps at the photo's edges."""
    fit_to_blur: bool = True
    """Sharpened edges move until, blurred again, they give the map that they came from."""
    refill_between_surfaces: bool = True
    """Lone disparities between two surfaces are filled again by what looks like them."""
    label_edge_bands: bool = True
    """Pixels beside a depth edge, or a defocused boundary, go to the side whose colours they have."""
    outpainting: bool = True
    """The photo is continued beyond its frame, once for all views."""
    outpainted_lines: bool = True
    """There lines go straight on."""
    split_mixed_pixels: bool = True
    """Pixels that show two surfaces become a ray of each."""
    leave_out_in_front: bool = True
    """What was inpainted in front of the photo's surfaces joins no rays."""
    share_inpainted: bool = True
    """What the outer views inpaint is seen by all views."""
    composite_partial_coverage: bool = True
    """What covers a pixel in part is laid over what was inpainted behind it."""
    ray_transformer: bool = True
    """Where several surfaces contest a ray, the ray transformer decides; else the closed form."""
    reopen_holes: bool = True
    """What was inpainted behind one of the photo's surfaces does not show through a hole in that surface."""
    synthesise_patches: bool = True
    """Inpainted pixels get the texture of their surface, by patches of it."""
    remove_flying_pixels: bool = True
    """Pixels that appear detached from their surface are replaced."""


ALL_STAGES = Stages()
STAGE_NAMES = tuple(stage.name.replace("_", "-") for stage in fields(Stages))
"""As the command line spells them."""


def stages_without(names: Iterable[str]) -> Stages:
    """All stages but these (STAGE_NAMES). Raises InputError, which lists them, for a name that is none."""
    left_out = list(names)
    for name in left_out:
        if name not in STAGE_NAMES:
            raise InputError(f"{name!r} is no stage; give one of {', '.join(STAGE_NAMES)}")
    return replace(ALL_STAGES, **{name.replace("-", "_"): False for name in left_out})
