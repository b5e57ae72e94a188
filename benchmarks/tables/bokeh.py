"""Pictures through a lens, made of one sharp photo and its disparity, against rays traced through that lens.

    python -m benchmarks.tables.bokeh [--scenes 4] [--out docs/tables/bokeh.md]

A set after the design of BokehMe's BLB: scenes, apertures, foci; the all-in-focus photo, true disparity and wrong maps.
Scenes are drawn like those that training learns from, by seeds of their own. Ours: the field of the photo and the map,
drawn by the viewer's renderer, here on software GL. Writes the report, and a picture to look at beside it.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import fmean
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.tables.lens_blurs import circle_radius, gather, scatter
from benchmarks.tables.report import FOLDER, markdown, write_report
from benchmarks.thin_lens import ThinLens
from iibr_core.color import bytes_from_encoded, encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.metrics import bounded_psnr, flip, ssim
from iibr_core.evaluation.tables import number
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.generation.view_maker import quantise_as_stored
from iibr_core.training import degradation as faults
from iibr_core.training.scenes.random_scene import RaycastScene, cast, random_scene, render
from iibr_core.types import Disparity, FloatImage, GridShape, ImageSize, Photo, Quality, ViewOffset
from viewer.gpu.context import GLContext
from viewer.gpu.headless_context import create_headless
from viewer.gpu.refocus.renderer import Renderer
from viewer.model.layout import ScreenSize
from viewer.model.state.optics import Optics

SIZE, GRID = ImageSize(192, 256), GridShape(9, 9)
QUALITY: Quality = "balanced"
FIRST_SEED = 9000
LARGEST_DISPARITY_PX = 2.0
RADII_VIEWS = (1.0, 2.0, 4.0)
FOCUS_PERCENTILES = (5, 35, 65, 95)
"""Of the true disparity, far to near."""
RAYS = 256
"""Of a pixel of the truth, each through a place of its own in the lens and in the pixel."""
PHOTO_SAMPLES = 5
BLUR_SIGMA_PX, EDGE_PX, PATCH_SIGMA_PX, NOISE_PX, GRAIN_PX = 2.0, 5, 8.0, 0.1, 1.0
TRUE, BLURRED, REFINED, EDGES, NOISY = "true", "blurred", "blurred, refined", "edges moved", "noisy"
SHARP, OURS, SCATTER, GATHER = "photo as it is", "ours", "scatter blur", "gather blur"
METHODS = (OURS, SCATTER, GATHER)
ALL = (SHARP, *METHODS)
QUALITY_HEAD = ("PSNR", "SSIM", "FLIP")
BLURS: dict[str, Callable[[FloatImage, FloatImage, ThinLens], FloatImage]] = {SCATTER: scatter, GATHER: gather}

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Exposure:
    """One setting of the lens. focus: percentile of the true disparity. truth: (H, W, 3), sRGB-encoded. inside: the
    part that is judged, where no circle of confusion reaches that begins outside the frame, which no photo shows.
    """

    lens: ThinLens
    focus: int
    truth: FloatImage
    inside: tuple[slice, slice]


@dataclass(frozen=True, eq=False)
class Shot:
    """A scene: the sharp photo (H, W, 3), sRGB-encoded; maps (H, W) by what is wrong with them; what a lens sees."""

    photo: FloatImage
    maps: dict[str, FloatImage]
    exposures: tuple[Exposure, ...]


@dataclass(frozen=True)
class Figures:
    """Of one picture, made with a map. before_s: what its field took, before any lens, drawing_s the picture itself;
    processor seconds.
    """

    method: str
    map: str
    radius: float
    focus: int
    db: float
    ssim: float
    flip: float
    before_s: float
    drawing_s: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=4)
    parser.add_argument("--out", type=Path, default=FOLDER / "bokeh.md")
    options = parser.parse_args()
    camera = LensCamera(create_headless())
    # What is compiled at its first use is no part of the figures.
    list(judge(camera, draw_shot(FIRST_SEED, ImageSize(48, 64), rays=2)))
    figures: list[Figures] = []
    shown: list[NDArray[np.uint8]] = []
    for seed in range(FIRST_SEED, FIRST_SEED + options.scenes):
        shot = draw_shot(seed, SIZE, RAYS)
        figures += judge(camera, shot)
        shown.append(_pictures_to_see(camera, shot))
        print(f"scene {seed}: done", flush=True)
    _save(options.out.with_suffix(".png"), np.concatenate(shown))
    write_report("bokeh", "Pictures through a lens", report_parts(figures, options.scenes), options.out)


def draw_shot(seed: int, size: ImageSize, rays: int) -> Shot:
    """The scene of a seed. rays: of a pixel, see `trace_lens`."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, size, LARGEST_DISPARITY_PX)
    pixels, disparity = render(scene, size, ViewOffset(0, 0), PHOTO_SAMPLES)
    photo = quantise_as_stored(pixels)
    exposures = []
    for radius, focus in product(RADII_VIEWS, FOCUS_PERCENTILES):
        lens = ThinLens(float(np.percentile(disparity, focus)), radius)
        margin = math.ceil(float(circle_radius(disparity, lens).max()))
        inside = slice(margin, size.height - margin), slice(margin, size.width - margin)
        exposures.append(Exposure(lens, focus, trace_lens(scene, size, lens, rays), inside))
    return Shot(photo, maps_of(photo, disparity, rng), tuple(exposures))


def trace_lens(scene: RaycastScene, size: ImageSize, lens: ThinLens, rays: int) -> FloatImage:
    """What a thin lens sees (H, W, 3), sRGB-encoded: distributed ray tracing (Cook et al. 1984).

    Every ray of a pixel goes through a place of its own in the round aperture and in the pixel's square, and through
    the plane in focus where that pixel sees it. rays: a power of two.
    """
    from scipy.stats.qmc import Sobol

    y, x = (grid.ravel() for grid in np.indices(size))
    light = np.zeros((len(x), 3))
    for out, turn, down, right in Sobol(4, rng=0).random(rays):
        r, angle = lens.radius_views * math.sqrt(out), 2 * math.pi * turn
        at = ViewOffset(r * math.sin(angle), r * math.cos(angle))
        x_there = x + right - 0.5 - lens.focus_disparity * at.s
        y_there = y + down - 0.5 - lens.focus_disparity * at.t
        light += linear_from_srgb(cast(scene, x_there, y_there, at, samples=1)[0])
    return srgb_from_linear(light / rays).reshape(*size, 3)


def maps_of(photo: FloatImage, disparity: FloatImage, rng: np.random.Generator) -> dict[str, FloatImage]:
    """The true map, three wrong ones, and the blurred one drawn to the photo's edges, (H, W).

    Edges moved: what is near grows in some places and shrinks in others, by half EDGE_PX.
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    patches = faults.blur(rng.standard_normal(disparity.shape).astype(np.float32), PATCH_SIGMA_PX)
    grown, shrunk = maximum_filter(disparity, EDGE_PX), minimum_filter(disparity, EDGE_PX)
    blurred = faults.blur(disparity, BLUR_SIGMA_PX)
    return {
        TRUE: disparity,
        BLURRED: blurred,
        REFINED: refine(photo, blurred),
        EDGES: np.where(patches > 0, grown, shrunk),
        NOISY: faults.add_noise(disparity, rng, NOISE_PX, GRAIN_PX),
    }


class LensCamera:
    """Our way: a field opened once, then pictures of any lens."""

    def __init__(self, gl: GLContext) -> None:
        self._gl, self._renderer = gl, Renderer(gl)
        self._size_px = ScreenSize(1, 1)

    def open(self, photo: FloatImage, disparity: FloatImage) -> None:
        """Make the field of a photo (H, W, 3), sRGB-encoded, and its disparity."""
        given, known = Photo(photo, float(photo.shape[1]), "photo"), Disparity(disparity, "map")
        self._size_px = ScreenSize(photo.shape[1], photo.shape[0])
        self._renderer.open_field(GRID, *self._size_px, hdr=False, with_disparity=True)
        for view in generate(given, known, plan_literal(given, known, GRID), quality=QUALITY):
            self._renderer.upload_view(view.row, view.column, view.colors, view.disparity)
        self._gl.ctx.finish()

    def take(self, lens: ThinLens) -> FloatImage:
        """The picture (H, W, 3), sRGB-encoded, drawn until nothing changes."""
        optics = Optics(focus_disparity=lens.focus_disparity, aperture_diameter=2 * lens.radius_views)
        self._renderer.render(optics, self._size_px)
        self._renderer.refine()
        return encoded_from_stored(self._renderer.read_image())


def judge(camera: LensCamera, shot: Shot) -> Iterator[Figures]:
    """Every method with every map at every exposure; the photo itself once."""
    for exposure in shot.exposures:
        yield _figures(SHARP, TRUE, exposure, shot.photo, 0.0, 0.0)
    for name, disparity in shot.maps.items():
        _, field_s = _timed(partial(camera.open, shot.photo, disparity))
        before_s = {OURS: field_s, SCATTER: 0.0, GATHER: 0.0}
        for exposure, method in product(shot.exposures, METHODS):
            picture, drawing_s = _timed(partial(_picture, method, camera, shot.photo, disparity, exposure.lens))
            yield _figures(method, name, exposure, picture, before_s[method], drawing_s)


def _figures(
    method: str, name: str, exposure: Exposure, picture: FloatImage, before_s: float, drawing_s: float
) -> Figures:
    made, truth = picture[exposure.inside], exposure.truth[exposure.inside]
    errors = bounded_psnr(made, truth), ssim(made, truth), flip(made, truth)
    return Figures(method, name, exposure.lens.radius_views, exposure.focus, *errors, before_s, drawing_s)


def _picture(method: str, camera: LensCamera, photo: FloatImage, disparity: FloatImage, lens: ThinLens) -> FloatImage:
    """(H, W, 3), sRGB-encoded, in 8 bits. Ours is of the field that is open."""
    if method == OURS:
        return camera.take(lens)
    return quantise_as_stored(srgb_from_linear(BLURS[method](linear_from_srgb(photo), disparity, lens)))


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What comes back, and the processor seconds of all threads."""
    start = time.process_time()
    return work(), time.process_time() - start


def report_parts(figures: Sequence[Figures], scenes: int) -> Iterator[str]:
    """What stands under the report's head."""
    yield (
        f"{scenes} scenes of {SIZE} px, seeds from {FIRST_SEED}, disparity to {LARGEST_DISPARITY_PX} px per view step;"
        f" apertures with a radius of {', '.join(f'{radius:g}' for radius in RADII_VIEWS)} view steps; focus at the"
        f" {', '.join(map(str, FOCUS_PERCENTILES))}th percentile of the true disparity, far to near. The truth:"
        f" {RAYS} rays of a pixel traced through the lens; scenes are matt. Ours: a field of {GRID.rows}x{GRID.columns}"
        f" views in quality *{QUALITY}*, drawn by software GL until nothing changes. *Blurred*: sigma"
        f" {BLUR_SIGMA_PX:g} px; *edges moved*: by {EDGE_PX // 2} px, in some places out, in others in; *noisy*: sigma"
        f" {NOISE_PX:g} px per view step. *refined*: drawn to the photo's edges first. Judged"
        " inside the frame, where no circle of confusion reaches from outside. Means over scenes and lenses; seconds"
        " are medians of processor time: *before* once for a photo (the field), then for each picture."
    )
    yield (
        "The published figures of DeepLens, DeepFocus, BokehMe and Dr.Bokeh are of other sets, so none of them stand"
        " here."
    )
    yield "## Maps"
    yield markdown(("map", "method", *QUALITY_HEAD, "s before", "s a picture"), _rows_of_maps(figures))
    exact = [each for each in figures if each.map == TRUE]
    yield "## Apertures and foci: PSNR in dB with the true map"
    by_radius = {f"radius {radius:g}": [f for f in exact if f.radius == radius] for radius in RADII_VIEWS}
    by_focus = {f"focus {focus} %": [f for f in exact if f.focus == focus] for focus in FOCUS_PERCENTILES}
    groups = by_radius | by_focus
    yield markdown(
        ("method", *groups),
        ((method, *(_mean((f.db for f in of(method, group)), 2) for group in groups.values())) for method in ALL),
    )
    yield (
        f"Each row a scene, aperture of {RADII_VIEWS[-1]:g}, focus far and then near, true map; left to right: the"
        f" truth, {', '.join(METHODS)}."
    )
    yield "![pictures](bokeh.png)"


def of(method: str, figures: Iterable[Figures]) -> list[Figures]:
    """Those of one method."""
    return [each for each in figures if each.method == method]


def _rows_of_maps(figures: Sequence[Figures]) -> Iterator[tuple[str, ...]]:
    for name, method in product((TRUE, BLURRED, REFINED, EDGES, NOISY), ALL):
        found = [each for each in of(method, figures) if each.map == name]
        if found:
            errors = (
                _mean((each.db for each in found), 2),
                _mean((each.ssim for each in found), 4),
                _mean((each.flip for each in found), 4),
            )
            times = (
                f"{np.median([each.before_s for each in found]):.3f}",
                f"{np.median([each.drawing_s for each in found]):.3f}",
            )
            yield name, method, *errors, *times


def _mean(values: Iterable[float], places: int) -> str:
    """In words, as many decimal places; "–" where there are none."""
    return number(fmean(found) if (found := list(values)) else math.nan, places)


def _pictures_to_see(camera: LensCamera, shot: Shot) -> NDArray[np.uint8]:
    """(2 H, 4 W, 3): the truth and every method with the true map, widest aperture, farthest and nearest focus."""
    disparity = shot.maps[TRUE]
    camera.open(shot.photo, disparity)
    rows = []
    for exposure in (shot.exposures[-len(FOCUS_PERCENTILES)], shot.exposures[-1]):
        made = [_picture(method, camera, shot.photo, disparity, exposure.lens) for method in METHODS]
        rows.append(np.concatenate([exposure.truth, *made], axis=1))
    return bytes_from_encoded(np.concatenate(rows))


def _save(path: Path, pixels: NDArray[np.uint8]) -> None:
    from matplotlib.image import imsave

    imsave(path, pixels)


if __name__ == "__main__":
    main()
