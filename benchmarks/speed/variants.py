"""The switches of the core that trade speed for error, and one scene's field made with each."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass

import cv2
import numpy as np
from iibr_core.generation.view_maker import ViewMaker

from benchmarks.harness.bench_scenes import CENTRE, MOST_JUDGED, BenchScene
from benchmarks.harness.timing import Cost, cost_of
from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.depth.edges.refine import refine
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.method.ambiguous_rays import HYPOTHESES
from iibr_core.types import (
    FloatImage,
    ImageSize,
    Quality,
    StoredColors,
    ViewOffset,
)


@dataclass(frozen=True)
class Variant:
    """One way to make a field. refined: strength of the refinement. shrink: of width and height.
    asks_every_ray: the transformer, not of contested rays only.
    """

    name: str
    quality: Quality = "fast"
    slots: int = 5
    hypotheses: int = HYPOTHESES
    refined: float = 1.0
    shrink: int = 1
    is_half_float: bool = False
    asks_every_ray: bool = False


REFERENCE = Variant("fast")
VARIANTS = (
    REFERENCE,
    Variant("balanced", "balanced"),
    Variant("exact", "balanced", asks_every_ray=True),
    *(Variant(f"K = {k} candidates", slots=k) for k in (1, 3)),
    Variant("balanced, 3 hypotheses", "balanced", hypotheses=3),
    Variant("no refinement", refined=0.0),
    Variant("half width", shrink=2),
    Variant("quarter width", shrink=4),
    Variant("stored as half floats", is_half_float=True),
)


def field_cost(variant: Variant, scene: BenchScene) -> Cost:
    """Of the whole field: setting up is timed, and a few views, from which the time of all follows."""
    makers: list[ViewMaker] = []
    with ExitStack() as open_until_done:
        cost = cost_of(lambda: makers.append(open_until_done.enter_context(_maker(variant, scene))))
        (maker,) = makers
        outer = {at for at in maker.outer} if variant.quality == "fast" else set()
        rest = [at for at in scene.field if at != CENTRE and at not in outer]
        sample = [rest[round(k)] for k in np.linspace(0, len(rest) - 1, min(len(rest), MOST_JUDGED))]
        if sample:
            rendering = cost_of(lambda: [_to_stored(v.colors, variant) for v in maker.views(variant.quality, sample)])
            cost += rendering.times(len(rest) / len(sample))
    return cost


def evaluated_views(variant: Variant, scene: BenchScene) -> dict[ViewOffset, FloatImage]:
    """The judged views of a variant, sRGB-encoded, at the scene's size."""
    with _maker(variant, scene) as maker:
        views = {at: _to_stored(maker.view(variant.quality, at).colors, variant) for at in scene.truth}
    return {at: _resize(encoded_from_stored(view), scene.photo.shape[:2]) for at, view in views.items()}


def _maker(variant: Variant, scene: BenchScene) -> ViewMaker:
    photo, disparity = scene.photo, scene.disparity
    if variant.shrink > 1:
        size = (max(photo.shape[0] // variant.shrink, 1), max(photo.shape[1] // variant.shrink, 1))
        ratio = np.float32(size[1] / photo.shape[1])
        photo, disparity = _resize(photo, size), resample_surfaces(disparity, ImageSize(*size)) * ratio
    disparity = _refine(variant, photo, disparity)
    return ViewMaker(
        photo, disparity, scene.field, (variant.quality,),
        slots=variant.slots, hypotheses=variant.hypotheses, every=variant.asks_every_ray,
    )  # fmt: skip


def _refine(variant: Variant, photo: FloatImage, disparity: FloatImage) -> FloatImage:
    return refine(photo, disparity, variant.refined) if variant.refined > 0 else disparity


def _to_stored(colors: FloatImage, variant: Variant) -> StoredColors:
    return stored_from_encoded(colors, variant.is_half_float)


def _resize(image: FloatImage, size: tuple[int, ...]) -> FloatImage:
    """The picture (H, W, 3) at another (height, width): Lanczos, or means of areas where it gets smaller."""
    if image.shape[:2] == tuple(size[:2]):
        return image
    way = cv2.INTER_AREA if size[0] < image.shape[0] else cv2.INTER_LANCZOS4
    return np.clip(cv2.resize(image, (size[1], size[0]), interpolation=way), 0, 1).astype(np.float32)
