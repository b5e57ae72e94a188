"""Maps found beside the window, each kind in its thread: entropy of a view, the surface under a click, gloss."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import extent_of
from iibr_core.gloss.settings import Gloss
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.scenes.scene_gloss import GlossRequest, make_maps
from iibr_core.stages import CLOSED_FORM
from viewer.background.newest import Failed, Newest, Post
from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.selection import surface_stroke
from viewer.model.state.inspection import ViewIndex
from viewer.model.state.notices import Notice

RANGE_PERCENTILES = 5.0, 95.0
"""Percentiles of the disparity of a surface that count as its far and near end."""


@dataclass(frozen=True, eq=False)
class EntropyRequest:
    """A view of the plan of a photo. inpaint: the inpainter of the scene's views."""

    generation: int
    view: ViewIndex
    loaded: LoadedPhoto
    plan: ScenePlan
    inpaint: str


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
                self._rays = view_maker(loaded.photo, disparity, plan, request.inpaint, stages=CLOSED_FORM).rays
                self._generation = request.generation
            values = view_entropy(self._rays, plan.grid.offset(*request.view))
        post(Entropy(request.generation, request.view, np.rint(values * 255).astype(np.uint8)))


@dataclass(frozen=True, eq=False)
class SurfaceRequest:
    """A place in a photo, (x, y) as shares of its size, and the tolerance of the flood; see `Stroke`."""

    place: tuple[float, float]
    tolerance: float
    loaded: LoadedPhoto
    plan: ScenePlan


@dataclass(frozen=True, eq=False)
class Surface:
    """The surface at a place. mask: (H, W), 255 where it is. range_px: (far, near) disparity in px per view step."""

    place: tuple[float, float]
    mask: NDArray[np.uint8]
    range_px: tuple[float, float]


def find_surface(request: SurfaceRequest, post: Post[Surface]) -> None:
    """Post the surface, as the bucket would fill it."""
    from iibr_core.depth.editing.bucket import surface_at

    plan, values = request.plan, request.loaded.disparity.values
    stroke = surface_stroke("fill", request.place, request.tolerance)
    mask = surface_at(request.loaded.photo.pixels, values, stroke, 0, extent_of(values))
    ends = np.percentile(values[mask], RANGE_PERCENTILES) if mask.any() else (0.0, 0.0)
    far, near = (float(end - plan.disparity_zero) * plan.disparity_scale for end in ends)
    post(Surface(request.place, mask * np.uint8(255), (far, near)))


class GlossFinder:
    """Finds gloss maps; until they are ready, the picture shows no gloss. asked: the last request."""

    def __init__(
        self,
        request_for: Callable[[Gloss | None], GlossRequest | None],
        take: Callable[[Any], None],
        wake: Callable[[], None],
    ) -> None:
        """request_for: returns the request for missing maps. take: shows maps. wake: called when there is a result."""
        self.asked: GlossRequest | None = None
        self._worker: Newest[GlossRequest, Any] = Newest("iibr-gloss", lambda ask, post: post(make_maps(ask)), wake)
        self._request_for, self._take = request_for, take
        self.close = self._worker.close

    def advance(self, gloss: Gloss | None) -> list[Action]:
        """Show new maps, report errors, and request missing maps. gloss: of the picture."""
        actions: list[Action] = []
        while (result := self._worker.next_result()) is not None:
            if isinstance(result, Failed):
                actions.append(do(messages.notify, Notice(result.message, is_error=True)))
            else:
                self._take(result)
        request = self._request_for(gloss)
        if request is not None and (self.asked is None or not self.asked.is_like(request)):
            self.asked = request
            self._worker.submit(request)
        return actions
