"""The switches of the core that trade speed for error, and one scene's field made with each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.harness.scenes import CENTRE, MOST_JUDGED, BenchScene
from benchmarks.harness.scenes import bench_scenes as bench_scenes
from benchmarks.harness.timing import Cost, cost_of
from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.depth.edges.refine import refine
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.generation.view_maker import ViewMaker
from iibr_core.rendering.ambiguous_rays import HYPOTHESES
from iibr_core.types import FloatImage, GridShape, ImageSize, Quality, StoredColors, ViewOffset
from viewer.gpu.context import GLContext
from viewer.gpu.refocus.renderer import Renderer
from viewer.model.state.optics import Optics

LEAST_STORED_SIDE = 5
"""Fields with fewer views a side have none to leave out."""


Stored = Mapping[ViewOffset, tuple[StoredColors, FloatImage]]
Draw = Callable[[Stored, Iterable[ViewOffset]], list[FloatImage]]
"""Pinhole pictures at these offsets from stored views and their disparity, as the viewer draws them."""


@dataclass(frozen=True)
class Variant:
    """One way to make a field. refined: strength of the refinement. shrink: of width and height. every: of the views
    across and down, store one in so many and let the viewer fill in; 0: centre and corners only.
    asks_every_ray: the transformer, not of contested rays only.
    """

    name: str
    quality: Quality = "fast"
    slots: int = 5
    hypotheses: int = HYPOTHESES
    refined: float = 1.0
    shrink: int = 1
    is_half_float: bool = False
    every: int = 1
    asks_every_ray: bool = False


REFERENCE = Variant("fast")
VARIANTS = (
    REFERENCE,
    Variant("balanced", "balanced"),
    Variant("exact", "balanced", asks_every_ray=True),
    *(Variant(f"K = {k} candidates", slots=k) for k in (1, 3, 8)),
    *(Variant(f"balanced, {k} hypotheses", "balanced", hypotheses=k) for k in (3, 9)),
    Variant("no refinement", refined=0.0),
    Variant("half width", shrink=2),
    Variant("quarter width", shrink=4),
    Variant("stored as half floats", is_half_float=True),
    Variant("every 2nd view stored", every=2),
    Variant("every 2nd view stored, balanced", "balanced", every=2),
    Variant("every 4th view stored", every=4),
    Variant("centre and corners stored", every=0),
)


def stored_offsets(variant: Variant, scene: BenchScene) -> list[ViewOffset]:
    """Which views of the field a variant makes, the centre's not counted."""
    return [at for at in scene.field if at != CENTRE and is_stored(at, scene.reach, variant.every)]


def is_stored(at: ViewOffset, reach: int, every: int) -> bool:
    """Whether a field that stores every so manieth view has this one; 0: the centre and the corners."""
    if every == 0:
        return at == CENTRE or abs(at.t) == abs(at.s) == reach
    return at.t % every == 0 and at.s % every == 0


def is_possible(variant: Variant, scene: BenchScene, has_drawing: bool) -> bool:
    """Whether the scene has views to leave out, and something draws what is between."""
    return variant.every == 1 or (has_drawing and 2 * scene.reach + 1 >= LEAST_STORED_SIDE)


@contextmanager
def pinhole_renderer(gl: GLContext) -> Iterator[Draw]:
    """What draws pinhole pictures from stored views, as the viewer fills in views that are not stored."""
    renderer = Renderer(gl)
    try:
        yield lambda stored, offsets: _draw_pinholes(renderer, stored, offsets)
    finally:
        renderer.release()


def _draw_pinholes(renderer: Renderer, stored: Stored, offsets: Iterable[ViewOffset]) -> list[FloatImage]:
    reach = round(max(abs(part) for at in stored for part in at))
    grid = GridShape(2 * reach + 1, 2 * reach + 1)
    colors = next(iter(stored.values()))[0]
    height, width = colors.shape[:2]
    renderer.open_field(grid, width, height, hdr=colors.dtype != np.uint8, with_disparity=True)
    for at, (pixels, disparity) in stored.items():
        renderer.upload_view(round(at.t) + reach, round(at.s) + reach, pixels, disparity)
    pictures = []
    for at in offsets:
        renderer.render(Optics(eye=at), (width, height))
        renderer.refine()
        pictures.append(encoded_from_stored(renderer.read_image()))
    return pictures


def field_cost(variant: Variant, scene: BenchScene) -> Cost:
    """Of the whole field: setting up is timed, and a few views, from which the time of all follows."""
    makers: list[ViewMaker] = []
    with ExitStack() as open_until_done:
        cost = cost_of(lambda: makers.append(open_until_done.enter_context(_maker(variant, scene))))
        (maker,) = makers
        outer = {at for at in maker.outer} if variant.quality == "fast" else set()
        rest = [at for at in stored_offsets(variant, scene) if at not in outer]
        sample = [rest[round(k)] for k in np.linspace(0, len(rest) - 1, min(len(rest), MOST_JUDGED))]
        if sample:
            rendering = cost_of(lambda: [_to_stored(v.colors, variant) for v in maker.views(variant.quality, sample)])
            cost += rendering.times(len(rest) / len(sample))
    return cost


def evaluated_views(variant: Variant, scene: BenchScene, draw: Draw | None) -> dict[ViewOffset, FloatImage]:
    """The judged views of a variant, sRGB-encoded, at the scene's size."""
    wanted = list(scene.truth)
    with _maker(variant, scene) as maker:
        if variant.every == 1:
            made = [encoded_from_stored(_to_stored(maker.view(variant.quality, at).colors, variant)) for at in wanted]
        else:
            assert draw is not None
            offsets = stored_offsets(variant, scene)
            stored: dict[ViewOffset, tuple[StoredColors, FloatImage]] = {
                at: (_to_stored(view.colors, variant), view.disparity)
                for at, view in zip(offsets, maker.views(variant.quality, offsets))
            }
            stored[CENTRE] = _to_stored(scene.photo, variant), _refine(variant, scene.photo, scene.disparity)
            made = draw(stored, wanted)
    return {at: _resize(image, scene.photo.shape[:2]) for at, image in zip(wanted, made)}


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
