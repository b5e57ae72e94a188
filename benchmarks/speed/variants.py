"""The switches of the core that trade speed for error, and one scene's field made with each."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.harness.bench_scenes import CENTRE, MOST_JUDGED, BenchScene
from benchmarks.harness.timing import Cost, cost_of
from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.depth.edges.refine import refine
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.method.photo_views import PhotoViews
from iibr_core.stages import ALL_STAGES, Stages, stages_without
from iibr_core.types import FloatImage, ImageSize, StoredColors, ViewOffset


@dataclass(frozen=True)
class Variant:
    """A way to make a field. stages: stages that are on. is_refined: whether the map is refined first. shrink: divides
    width and height. is_half_float: whether views are stored as half floats.
    """

    name: str
    stages: Stages = ALL_STAGES
    is_refined: bool = True
    shrink: int = 1
    is_half_float: bool = False


REFERENCE = Variant("iibr")
VARIANTS = (
    REFERENCE,
    Variant("no ray transformer", stages_without(["ray-transformer"])),
    Variant("no refinement", is_refined=False),
    Variant("half width", shrink=2),
    Variant("quarter width", shrink=4),
    Variant("stored as half floats", is_half_float=True),
)


def field_cost(variant: Variant, scene: BenchScene) -> Cost:
    """Return the cost of the whole field: of setting up, and of a few views, from which that of all follows."""
    made: list[PhotoViews] = []
    cost = cost_of(lambda: made.append(_views(variant, scene)))
    ready = {CENTRE, *(made[0].outer if variant.stages.share_inpainted else ())}
    rest = [at for at in scene.field if at not in ready]
    sample = [rest[round(k)] for k in np.linspace(0, len(rest) - 1, min(len(rest), MOST_JUDGED))]
    if sample:
        rendering = cost_of(lambda: [_to_stored(view.colors, variant) for view in made[0].views(sample)])
        cost += rendering.times(len(rest) / len(sample))
    return cost


def evaluated_views(variant: Variant, scene: BenchScene) -> dict[ViewOffset, FloatImage]:
    """Return the judged views of a variant, sRGB-encoded, at the scene's size."""
    views = _views(variant, scene)
    stored = {at: _to_stored(views.view(at).colors, variant) for at in scene.truth}
    return {at: _resize(encoded_from_stored(view), scene.photo.shape[:2]) for at, view in stored.items()}


def _views(variant: Variant, scene: BenchScene) -> PhotoViews:
    photo, disparity = scene.photo, scene.disparity
    if variant.shrink > 1:
        size = (max(photo.shape[0] // variant.shrink, 1), max(photo.shape[1] // variant.shrink, 1))
        ratio = np.float32(size[1] / photo.shape[1])
        photo, disparity = _resize(photo, size), resample_surfaces(disparity, ImageSize(*size)) * ratio
    disparity = refine(photo, disparity) if variant.is_refined else disparity
    return PhotoViews(photo, disparity, scene.field, variant.stages)


def _to_stored(colors: FloatImage, variant: Variant) -> StoredColors:
    return stored_from_encoded(colors, variant.is_half_float)


def _resize(image: FloatImage, size: tuple[int, ...]) -> FloatImage:
    """Return the picture (H, W, 3) at another (height, width): by Lanczos, or by means of areas if it gets smaller."""
    if image.shape[:2] == tuple(size[:2]):
        return image
    way = cv2.INTER_AREA if size[0] < image.shape[0] else cv2.INTER_LANCZOS4
    return np.clip(cv2.resize(image, (size[1], size[0]), interpolation=way), 0, 1).astype(np.float32)
