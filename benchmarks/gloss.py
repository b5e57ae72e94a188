"""Simulated specularity against path-traced truth: where highlights run on the EPI, how far views are from the truth,
and what it costs.

    python -m benchmarks.gloss_scenes --out TRUTH     (needs Mitsuba)
    python -m benchmarks.gloss --truth TRUTH [--out docs/gloss.md]

The photo shows the surface matt, and roughness, reflectance and light are given; or it shows the highlight, and they
are given but for the light's strength; or it shows the highlight and no light is known. Each against the same views
without gloss. Where the matt photo's views come to hardly more, a photo that shows its highlight has no more to gain:
the rest is resampling, and what the photo does not see.

Slope: px that the highlight runs over its surface per view step. Bend: px per view step squared, judged where it comes
to more than a pixel at the outermost view.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.report import emit, head, parser_of, row, start, title
from benchmarks.harness.timing import cost_of
from iibr_core.color import encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.rendering.gloss.geometry import SceneGeometry
from iibr_core.rendering.gloss.settings import Gloss, GlossLight, GlossSurface
from iibr_core.rendering.gloss.shading import make_gloss_maps, shade, shade_views
from iibr_core.types import Disparity, FloatImage, GridShape, Photo, ViewOffset, ViewUpdate

SCENES = (
    *("sphere", "plane", "cylinder", "near_sphere", "grazed_sphere", "near_cylinder"),
    *("table", "ball", "post"),
)
DARK = GlossLight(color=(0.0, 0.0, 0.0))
LARGE = 1024
"""Side of the picture that is timed."""


@dataclass(frozen=True, eq=False)
class Truth:
    """A scene of benchmarks.gloss_scenes: linear views (V, U, H, W, 3) with and without gloss; where it is glossy."""

    views: FloatImage
    matt_views: FloatImage
    glossy: NDArray[np.bool_]
    disparity: FloatImage
    gloss: Gloss
    geometry: SceneGeometry

    @property
    def grid(self) -> GridShape:
        """Of the views."""
        return GridShape(*self.views.shape[:2])


@dataclass(frozen=True)
class Track:
    """A highlight on the EPI of the middle row of views: px that it runs over its surface per view step, and how much
    it bends, px per view step squared.
    """

    slope: float
    bend: float


def read(path: Path) -> Truth:
    held = np.load(path)
    # The surface is what stands before the wall: the share of the range that lies before its back.
    disparity = held["disparity"]
    glossy = held["glossy"][GridShape(*held["glossy"].shape[:2]).centre]
    low, high = disparity.min(), disparity.max()
    farthest = float((disparity[glossy].min() - low) / (high - low))
    light = GlossLight(tuple(held["light"].tolist()), (float(held["light_color"]),) * 3, float(held["light_radius"]))
    gloss = Gloss(
        GlossSurface(farthest=max(farthest - 0.02, 0)),
        float(held["roughness"]),
        float(held["reflectance"]),
        light,
    )
    views, matt = held["views"].astype(np.float32), held["matt_views"].astype(np.float32)
    geometry = SceneGeometry(float(held["focal_px"]), float(held["infinity"]))
    return Truth(views, matt, held["glossy"], disparity, gloss, geometry)


def made_views(truth: Truth, photo: FloatImage) -> list[ViewUpdate]:
    """All views of a photo (H, W, 3, encoded) as the program makes them without gloss."""
    picture, disparity = Photo(photo, truth.geometry.focal_px, "truth"), Disparity(truth.disparity, "truth")
    return list(generate(picture, disparity, plan_literal(picture, disparity, truth.grid)))


def linear_views(views: Iterable[ViewUpdate]) -> dict[tuple[int, int], FloatImage]:
    """Linear light (H, W, 3) by row and column."""
    return {(view.row, view.column): linear_from_srgb(encoded_from_stored(view.colors)) for view in views}


def highlight_track(highlights: list[FloatImage], disparity: float) -> Track:
    """Of pictures (H, W) of a highlight alone, left to right: how its middle runs over a surface of that disparity."""
    steps = np.arange(len(highlights)) - len(highlights) // 2
    places = []
    for picture in highlights:
        bright = np.maximum(picture - 0.3 * picture.max(), 0)
        places.append(float((bright.sum(0) * np.arange(bright.shape[1])).sum() / max(bright.sum(), 1e-9)))
    bend, slope, _ = np.polyfit(steps, np.array(places) + disparity * steps, 2)
    return Track(float(slope), float(bend))


@dataclass(frozen=True)
class Verdict:
    """PSNR of the glossy thing, the mean over all views but the photo's, with and without gloss; and both tracks."""

    gloss_db: float
    matt_db: float
    true: Track
    made: Track


def judge(truth: Truth, photo: FloatImage, plain: list[ViewUpdate], matt: list[ViewUpdate], gloss: Gloss) -> Verdict:
    """photo: (H, W, 3), encoded. plain, matt: views made of it, and of the matt photo, without gloss."""
    maps = make_gloss_maps(gloss, photo, truth.disparity, truth.geometry)
    made = {
        "gloss": linear_views(shade_views(iter(plain), maps, truth.grid)),
        "plain": linear_views(plain),
        "matt": linear_views(matt),
    }
    others = [place for place in np.ndindex(*truth.grid) if place != truth.grid.centre]
    ratios = {
        name: np.mean([bounded_psnr(encoded(views[at]), encoded(truth.views[at]), truth.glossy[at]) for at in others])
        for name, views in made.items()
    }
    row = truth.grid.centre[0]
    places = [(row, u) for u in range(truth.grid.columns)]
    # as pictures show it: cut off at white
    true_light = [(truth.views[at].clip(0, 1) - truth.matt_views[at].clip(0, 1)).mean(-1) for at in places]
    made_light = [(made["gloss"][at] - made["matt"][at]).mean(-1) for at in places]
    surface = float(truth.disparity.flat[true_light[len(places) // 2].argmax()])
    tracks = [
        highlight_track([light * truth.glossy[at] for at, light in zip(places, lights)], surface)
        for lights in (true_light, made_light)
    ]
    return Verdict(float(ratios["gloss"]), float(ratios["plain"]), *tracks)


def off_by(made: float, true: float, reach: float) -> str:
    """How far a figure of a track is from the truth; nothing where over the views it comes to less than a pixel."""
    return f"{abs(made / true - 1):.1%}" if abs(true) * reach > 1 else "-"


def encoded(linear: FloatImage) -> FloatImage:
    """As a picture holds it."""
    return np.clip(srgb_from_linear(linear), 0, 1)


def cost(truth: Truth, photo: FloatImage) -> tuple[float, float, float]:
    """Processor milliseconds: preparing the maps, shading a view, and making a view, all of LARGE squared pixels."""
    times = -(-LARGE // truth.disparity.shape[0])
    factor = float(times)
    disparity = np.kron(truth.disparity, np.ones((times, times), np.float32))
    large = np.kron(photo, np.ones((times, times, 1), np.float32))
    geometry = replace(truth.geometry, focal_px=truth.geometry.focal_px * factor)
    maps = make_gloss_maps(truth.gloss, large, disparity, geometry)
    shading = partial(shade, large.copy(), disparity, ViewOffset(1.0, 1.0), maps)
    shading()
    prepared = cost_of(lambda: make_gloss_maps(truth.gloss, large, disparity, geometry))
    shaded = cost_of(shading)
    picture, map_ = Photo(large, geometry.focal_px, "truth"), Disparity(disparity, "truth")
    made = cost_of(lambda: list(generate(picture, map_, plan_literal(picture, map_, truth.grid))))
    return 1e3 * prepared.cpu_s, 1e3 * shaded.cpu_s, 1e3 * made.cpu_s / (truth.grid.rows * truth.grid.columns)


def report(folder: Path) -> Iterator[str]:
    """The lines of the report."""
    more = "Truth by benchmarks.gloss_scenes, Mitsuba 3.9.1. Nothing was fitted to `table`, `ball` and `post`."
    yield title("Simulated specularity", "benchmarks.gloss", more)
    yield __doc__[__doc__.index("The photo") :]
    tracks = "true slope", "made", "off", "true bend", "made", "off"
    yield head("scene", "photo", "with gloss, dB", "without", "gain", *tracks)
    for name in SCENES:
        truth = read(folder / f"{name}.npz")
        matt, shining = encoded(truth.matt_views[truth.grid.centre]), encoded(truth.views[truth.grid.centre])
        matt_views, shining_views = made_views(truth, matt), made_views(truth, shining)
        half = truth.grid.columns // 2
        for case, photo, plain, gloss in (
            ("matt", matt, matt_views, truth.gloss),
            ("shines, light given", shining, shining_views, replace(truth.gloss, photo_shines=True)),
            ("shines, light unknown", shining, shining_views, replace(truth.gloss, light=DARK, photo_shines=True)),
        ):
            said = judge(truth, photo, plain, matt_views, gloss)
            true, made = said.true, said.made
            gain = f"{said.gloss_db:.2f}", f"{said.matt_db:.2f}", f"{said.gloss_db - said.matt_db:+.2f} dB"
            slope = f"{true.slope:.3f}", f"{made.slope:.3f}", off_by(made.slope, true.slope, half)
            bend = f"{true.bend:+.4f}", f"{made.bend:+.4f}", off_by(made.bend, true.bend, half**2)
            yield row(name, case, *gain, *slope, *bend)
    prepared, shaded, made = cost(truth, matt)
    yield f"\nProcessor time at {LARGE}x{LARGE}: {prepared:.0f} ms once for the surface's normals and mask,"
    yield f"{shaded:.0f} ms a view, which takes {made:.0f} ms without gloss. Without gloss none of it runs."


def main() -> None:
    parser = parser_of(__doc__, "out")
    parser.add_argument("--truth", type=Path, required=True, help="folder written by benchmarks.gloss_scenes")
    options = parser.parse_args()
    emit(report(options.truth), options.out)


if __name__ == "__main__":
    start("benchmarks.gloss", main)
