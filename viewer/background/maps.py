"""Maps found beside the window, each kind in its thread: entropy of a view, the surface under a click, gloss."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import Stroke, extent_of
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.scenes.scene_gloss import GlossRequest, make_maps
from viewer.background.newest import Post
from viewer.model.inspection import ViewIndex

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps

RANGE_PERCENTILES = 5.0, 95.0
"""Percentiles of the disparity of a surface that count as its far and near end."""
OUTLINE_SHARE = 1 / 800
"""Width of the outline of a selected surface, as a share of the photo's width."""


@dataclass(frozen=True)
class EntropyRequest:
    """A view of the plan of a photo. inpaint: the inpainter of the scene's views."""

    generation: int
    view: ViewIndex
    loaded: LoadedPhoto = field(compare=False)
    plan: ScenePlan = field(compare=False)
    inpaint: str = field(compare=False)


@dataclass(frozen=True, eq=False)
class Entropy:
    """Entropy (H, W) of the weights of a view, 255 = 1."""

    generation: int
    view: ViewIndex
    values: NDArray[np.uint8]


class EntropyWork:
    """Carries out requests in one thread; keeps the rays of one scene between them."""

    def __init__(self) -> None:
        self._generation = -1

    def __call__(self, request: EntropyRequest, post: Post[Entropy]) -> None:
        """Post the entropy of the view."""
        from iibr_core.method.light_field import view_maker
        from iibr_core.method.occlusion import view_entropy

        loaded, plan = request.loaded, request.plan
        values = np.zeros(loaded.photo.size, np.float32)  # the rays of the middle view are the photo's
        if request.view != plan.grid.centre:
            if self._generation != request.generation:
                disparity = plan.field_disparity(loaded.disparity)
                self._rays = view_maker(loaded.photo, disparity, plan, request.inpaint).rays
                self._generation = request.generation
            values = view_entropy(self._rays, plan.grid.offset(*request.view))
        post(Entropy(request.generation, request.view, np.rint(values * 255).astype(np.uint8)))


@dataclass(frozen=True)
class SurfaceRequest:
    """The stroke that would change a selected surface of a photo."""

    stroke: Stroke
    loaded: LoadedPhoto
    plan: ScenePlan = field(compare=False)


@dataclass(frozen=True, eq=False)
class Surface:
    """A selected surface. outline: (H, W), 255 on it. range_px: (far, near) disparity in px per view step."""

    outline: NDArray[np.uint8]
    range_px: tuple[float, float]


class SurfaceWork:
    """Finds selected surfaces in one thread; keeps the flood while only the brush changes the selection."""

    def __init__(self) -> None:
        self._known: tuple[LoadedPhoto, Stroke, NDArray[np.bool_]] | None = None

    def __call__(self, request: SurfaceRequest, post: Post[Surface]) -> None:
        """Post the surface that the stroke would change."""
        from iibr_core.depth.editing.selected import flooded, patched

        plan, loaded, stroke = request.plan, request.loaded, request.stroke
        photo, values = loaded.photo.pixels, loaded.disparity.values
        base = replace(stroke, patches=())
        if self._known is None or self._known[0] is not loaded or self._known[1] != base:
            self._known = loaded, base, flooded(photo, values, base, extent_of(values))
        mask = patched(photo, self._known[2], stroke)
        ends = np.percentile(values[mask], RANGE_PERCENTILES) if mask.any() else (0.0, 0.0)
        far, near = (float(end - plan.disparity_zero) * plan.disparity_scale for end in ends)
        post(Surface(outline_of(mask) * np.uint8(255), (far, near)))


def outline_of(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the pixels of a mask (H, W) beside those outside it; the border has no outline."""
    inside = mask.copy()
    for _ in range(max(round(OUTLINE_SHARE * mask.shape[1]), 1)):
        around = np.pad(inside, 1, mode="edge")
        inside = inside & around[2:, 1:-1] & around[:-2, 1:-1] & around[1:-1, 2:] & around[1:-1, :-2]
    return mask & ~inside


def find_gloss(request: GlossRequest, post: Post[GlossMaps]) -> None:
    """Post the gloss maps; until they are ready, the picture shows no gloss."""
    post(make_maps(request))
