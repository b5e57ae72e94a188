"""The renderer's switches: the time of one picture, drawn in many ways, against its error.

The best picture, which errors are against, is a plain float sum in numpy over four times as many views as are stored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.harness.scenes import BenchScene
from benchmarks.harness.timing import Cost, cost_of, in_turns, median_cost, median_ratio
from benchmarks.speed.report import Figures, Measured
from benchmarks.speed.variants import Draw, Stored, is_stored
from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.evaluation.metrics import bounded_psnr, flip
from iibr_core.evaluation.refocus import FocalStack, Focus
from iibr_core.generation.cost_model import CORES
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.rendering.optics import Optics
from iibr_core.types import FloatImage, GridShape, ReportProgress, ViewOffset
from viewer.gpu.context import GLContext
from viewer.gpu.refocus.frame_budget import BEST_QUALITY, QualityLevel, scale_size, stretch_image
from viewer.gpu.refocus.renderer import Renderer

APERTURE_VIEWS = 6.0
BETWEEN = ViewOffset(-0.5, 1.5)
"""An eye between the stored views, on one of those that only the best picture has."""
DRAWING = (
    "Time of one picture against drawing it *at once*, what the viewer shows first; errors are against a float sum of"
    " four times as many views in numpy."
)
FINER = 2
"""Views of the best picture, to each stored one across and down."""


@dataclass(frozen=True)
class DrawVariant:
    """One way to draw the same picture. every: of the views across and down, one in so many is stored; 0: centre and
    corners only. is_half_float: textures of half floats instead of bytes. is_converged: every sample there is.
    """

    name: str
    level: QualityLevel = BEST_QUALITY
    prefilter: bool = True
    adaptive: bool = True
    every: int = 1
    is_half_float: bool = False
    knows_disparity: bool = True
    is_converged: bool = False

    @property
    def stored(self) -> tuple[int, bool, bool]:
        """What has to be uploaded for it."""
        return self.every, self.is_half_float, self.knows_disparity


REFERENCE = DrawVariant("at once")
STORAGE = (
    DrawVariant("textures of half floats", is_half_float=True),
    DrawVariant("every 2nd view stored", every=2),
    DrawVariant("every 2nd view stored, until converged", every=2, is_converged=True),
    DrawVariant("centre and corners stored", every=0),
    DrawVariant("centre and corners stored, until converged", every=0, is_converged=True),
)
APERTURE_VARIANTS = (
    REFERENCE,
    DrawVariant("until converged", is_converged=True),
    DrawVariant("half the picture's width", QualityLevel(scale=0.5)),
    DrawVariant("every 2nd sample across and down", QualityLevel(stride=2)),
    DrawVariant("every 2nd sample, half width", QualityLevel(stride=2, scale=0.5)),
    DrawVariant("every 3rd sample, half width", QualityLevel(stride=3, scale=0.5)),
    DrawVariant("no smoothing", prefilter=False),
    DrawVariant("no smoothing, every 2nd sample", QualityLevel(stride=2), prefilter=False),
    DrawVariant("tiles skip nothing", adaptive=False),
    *STORAGE,
    DrawVariant("views without disparity", knows_disparity=False),
)
PINHOLE_VARIANTS = (
    REFERENCE,
    DrawVariant("until converged", is_converged=True),
    DrawVariant("of 2 views", QualityLevel(sources=2)),
    DrawVariant("of 1 view", QualityLevel(sources=1)),
    DrawVariant("half the picture's width", QualityLevel(scale=0.5)),
    DrawVariant("of 1 view, half width", QualityLevel(sources=1, scale=0.5)),
    *STORAGE,
    DrawVariant("plain blending, no disparity", knows_disparity=False),
)


def draw(renderer: Renderer, optics: Optics, size_px: tuple[int, int], variant: DrawVariant) -> None:
    """Draw a variant whose views are uploaded."""
    renderer.prefilter, renderer.adaptive = variant.prefilter, variant.adaptive
    renderer.render(optics, scale_size(size_px, variant.level.scale), level=variant.level)
    if variant.is_converged:
        renderer.refine()


def drawing_cost(gl: GLContext, draw_it: Callable[[], None]) -> Cost:
    """Of a drawing, once everything before it is done. cpu_s: what it takes alone: on software GL processor time over
    the cores, which other programs disturb less, else time by the clock.
    """
    gl.ctx.finish()

    def work() -> None:
        draw_it()
        gl.ctx.finish()

    cost = cost_of(work)
    return Cost(cost.wall_s, cost.cpu_s / CORES if gl.is_software else cost.wall_s)


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


def measure_drawing(
    gl: GLContext, scene: BenchScene, repeats: int, report_progress: ReportProgress
) -> Iterator[Figures]:
    """A refocused picture, and one through a pinhole between the views, of a scene's field, drawn in every way."""
    focus, diameter = float(np.median(scene.disparity)), min(APERTURE_VIEWS, 2.0 * scene.reach)
    refocused = Optics(focus_disparity=focus, aperture_diameter=diameter)
    pictures = {
        f"{scene.name}, refocused, aperture of {diameter:g} view steps": (refocused, APERTURE_VARIANTS),
        f"{scene.name}, pinhole between views": (Optics(eye=BETWEEN), PINHOLE_VARIANTS),
    }
    report_progress(0, 1, f"{scene.name}: the best picture")
    best = best_pictures(scene, refocused)
    drawer = _Drawer(gl, scene)
    try:
        for truth, (what, (optics, variants)) in zip(best, pictures.items()):
            ways = {variant.name: partial(drawer.cost, optics, variant) for variant in variants}
            errors = [drawer.errors(optics, variant, truth) for variant in variants]
            costs = in_turns(ways, repeats, report_progress)
            drawn = tuple(
                Measured(name, median_cost(own), median_ratio(own, costs[REFERENCE.name]), *figures)
                for (name, own), figures in zip(costs.items(), errors)
            )
            yield Figures(f"Drawing: {what}", DRAWING, drawn)
    finally:
        drawer.renderer.release()


class _Drawer:
    """Draws variants of one field, with the views that each wants uploaded."""

    def __init__(self, gl: GLContext, scene: BenchScene) -> None:
        self.gl, self.renderer = gl, Renderer(gl)
        self._grid, self._size_px = scene.grid, (scene.photo.shape[1], scene.photo.shape[0])
        self._views = list(generate(*scene.given, plan_literal(*scene.given, scene.grid), quality="fast"))
        self._uploaded: tuple[int, bool, bool] | None = None

    def cost(self, optics: Optics, variant: DrawVariant) -> Cost:
        """Of one picture."""
        self._upload(variant)
        self.renderer.render(optics, self._size_px, level=variant.level)  # what is uploaded has to arrive first
        return drawing_cost(self.gl, lambda: draw(self.renderer, optics, self._size_px, variant))

    def errors(self, optics: Optics, variant: DrawVariant, truth: FloatImage) -> tuple[float, float, int]:
        """PSNR, FLIP, samples drawn."""
        self._upload(variant)
        draw(self.renderer, optics, self._size_px, variant)
        image = stretch_image(self.renderer.read_image(), self._size_px).astype(np.float32) / np.float32(255)
        margin = (image.shape[0] - truth.shape[0]) // 2
        image = image[margin : margin + truth.shape[0], margin : margin + truth.shape[1]]
        return bounded_psnr(image, truth), flip(image, truth), self.renderer.samples_drawn

    def _upload(self, variant: DrawVariant) -> None:
        if variant.stored == self._uploaded:
            return
        is_half_float, knows_disparity = variant.is_half_float, variant.knows_disparity
        self.renderer.open_field(self._grid, *self._size_px, hdr=is_half_float, with_disparity=knows_disparity)
        for view in self._views:
            if is_stored(self._grid.offset(view.row, view.column), self._grid.centre[0], variant.every):
                colors = stored_from_encoded(encoded_from_stored(view.colors), True) if is_half_float else view.colors
                self.renderer.upload_view(view.row, view.column, colors, view.disparity if knows_disparity else None)
        self._uploaded = variant.stored


def best_pictures(scene: BenchScene, optics: Optics, eye: ViewOffset = BETWEEN) -> tuple[FloatImage, FloatImage]:
    """Of views FINER times as close as the field's: refocused by evaluation's plain sum, the part that all
    show, and the one of an eye; (H, W, 3), sRGB-encoded.
    """
    side = FINER * 2 * scene.reach + 1
    grid, (photo, disparity) = GridShape(side, side), replace(scene, disparity=scene.disparity / FINER).given
    stack = FocalStack([Focus("", optics.focus_disparity / FINER, FINER * optics.aperture_diameter / 2)])
    for view in generate(photo, disparity, plan_literal(photo, disparity, grid), quality="fast"):
        at, colors = grid.offset(view.row, view.column), encoded_from_stored(view.colors)
        stack.add(at, colors)
        if at == (FINER * eye.t, FINER * eye.s):
            between = colors
    return stack.pictures()[0], between
