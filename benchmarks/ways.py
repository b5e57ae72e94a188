"""Ways to make views of a photo with a map: ours, a plain warp, and the photo itself.

Every way takes a scene and returns a function from a viewpoint to the view (H, W, 3), sRGB-encoded.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from benchmarks.scenes import Scene
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.warp import reference_warp
from iibr_core.method.light_field import ViewMaker
from iibr_core.stages import ALL_STAGES, STAGE_NAMES, Stages, stages_without
from iibr_core.types import FloatImage, InputError, ViewOffset

MakeView = Callable[[ViewOffset], FloatImage]
Way = Callable[[Scene], MakeView]


def iibr(scene: Scene, stages: Stages = ALL_STAGES, refines: bool = True) -> MakeView:
    """Return our views, with all stages or some. refines: the map's edges are drawn to the photo's."""
    disparity = scene.disparity
    if refines:
        disparity = refine(scene.photo, disparity, stages=stages, is_enlarged=scene.is_enlarged)
    views = ViewMaker(scene.photo, disparity, scene.field, stages=stages)
    _ = views.rays  # made now: `compare` counts the time of this once
    return lambda at: views.view(at).colors


WAYS: dict[str, Way] = {
    "iibr": iibr,
    "iibr map not refined": partial(iibr, refines=False),
    "plain warp": lambda scene: lambda at: reference_warp(scene.photo, scene.disparity, at).colors,
    "unchanged photo": lambda scene: lambda at: scene.photo,
    **{f"iibr without {name}": partial(iibr, stages=stages_without([name])) for name in STAGE_NAMES},
}


def chosen_ways(words: str) -> dict[str, Way]:
    """Return the ways that begin with one of these words, in their order. Raises InputError for a word of none."""
    found: dict[str, Way] = {}
    for word in words.split(","):
        names = [word] if word in WAYS else [name for name in WAYS if name.startswith(word)]
        if not names:
            raise InputError(f"{word!r} is no way to make views; give some of: {'; '.join(WAYS)}")
        found |= {name: WAYS[name] for name in names}
    return found
