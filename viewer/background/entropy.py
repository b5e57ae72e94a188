"""Entropy of the weights of a view, for its overlay. The rays of one scene are kept between requests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto
from viewer.background.newest import Post
from viewer.model.state.inspection import ViewIndex


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
    """Entropy (H, W) of a view, 255 = 1."""

    generation: int
    view: ViewIndex
    values: NDArray[np.uint8]


class EntropyWork:
    """Carries out requests, in one thread."""

    def __init__(self) -> None:
        self._generation = -1

    def __call__(self, request: EntropyRequest, post: Post[Entropy]) -> None:
        """Post the entropy of the view. Raises Cancelled."""
        from iibr_core.inpainting.registry import load_inpainter
        from iibr_core.method.light_field import complete_rays
        from iibr_core.method.occlusion import view_entropy
        from iibr_core.method.ray_transformer import shipped_transformer
        from iibr_core.method.view import Renderer

        loaded, plan = request.loaded, request.plan
        values = np.zeros(loaded.photo.size, np.float32)  # the rays of the middle view are the photo's
        if request.view != plan.grid.centre:
            if self._generation != request.generation:
                renderer = Renderer(shipped_transformer(), load_inpainter(request.inpaint))
                self._rays = complete_rays(loaded.photo, plan.field_disparity(loaded.disparity), plan, renderer)
                self._generation = request.generation
            values = view_entropy(self._rays, plan.grid.offset(*request.view))
        post(Entropy(request.generation, request.view, np.rint(values * 255).astype(np.uint8)))
