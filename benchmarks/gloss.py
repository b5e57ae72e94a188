"""Simulated specularity against path-traced truth: where highlights run on the EPI, how far views are from the truth,
and what it costs.

    python -m benchmarks.gloss_scenes --out TRUTH     (needs Mitsuba)
    python -m benchmarks.gloss --truth TRUTH [--out docs/gloss.md]

"given": the photo shows the surface matt, and roughness, reflectance and light are given. "found": the photo shows the
highlight, and nothing is given but that it does. Both against the same views without gloss.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.rendering.gloss.geometry import SceneGeometry
from iibr_core.rendering.gloss.settings import Gloss, GlossLight, GlossSurface
from iibr_core.rendering.gloss.shading import make_gloss_maps, shade, shade_views
from iibr_core.types import Disparity, FloatImage, GridShape, Photo, ViewOffset, ViewUpdate

SCENES = ("sphere", "plane", "cylinder")
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
    disparity, glossy = held["disparity"], held["glossy"][2, 2]
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


def made_views(truth: Truth, photo: FloatImage, gloss: Gloss | None) -> dict[tuple[int, int], FloatImage]:
    """All views of a photo (H, W, 3, encoded) as the program makes them: linear light."""
    picture = Photo(photo, truth.geometry.focal_px, "truth")
    disparity = Disparity(truth.disparity, "truth")
    views: Iterator[ViewUpdate] = generate(picture, disparity, plan_literal(picture, disparity, truth.grid))
    if gloss is not None:
        views = shade_views(views, make_gloss_maps(gloss, photo, truth.disparity, truth.geometry), truth.grid)
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


def judge(truth: Truth, photo: FloatImage, gloss: Gloss) -> dict[str, float]:
    """PSNR of the glossy thing over all views but the photo's, with gloss and without; and both tracks."""
    with_gloss, without = made_views(truth, photo, gloss), made_views(truth, photo, None)
    ratios: dict[str, list[float]] = {"gloss": [], "matt": []}
    for v, u in np.ndindex(*truth.grid):
        if (v, u) == truth.grid.centre:
            continue
        true = np.clip(srgb_from_linear(truth.views[v, u]), 0, 1)
        for name, made in (("gloss", with_gloss), ("matt", without)):
            ratios[name].append(bounded_psnr(np.clip(srgb_from_linear(made[v, u]), 0, 1), true, truth.glossy[v, u]))
    row, columns = truth.grid.centre[0], range(truth.grid.columns)
    true_gloss = [truth.views[row, u] - truth.matt_views[row, u] for u in columns]
    cap = [np.minimum(truth.views[row, u], 1) - np.minimum(truth.matt_views[row, u], 1) for u in columns]
    matt = made_views(truth, np.clip(srgb_from_linear(truth.matt_views[2, 2]), 0, 1), None)
    made_gloss = [with_gloss[row, u] - matt[row, u] for u in columns]
    del true_gloss
    brightest = np.unravel_index(np.argmax(cap[2].mean(-1)), cap[2].shape[:2])
    surface = float(truth.disparity[brightest])
    glossy = [truth.glossy[row, u] for u in columns]
    true_track = highlight_track([g.mean(-1) * m for g, m in zip(cap, glossy)], surface)
    made_track = highlight_track([g.mean(-1) * m for g, m in zip(made_gloss, glossy)], surface)
    return {
        "gloss_db": float(np.mean(ratios["gloss"])),
        "matt_db": float(np.mean(ratios["matt"])),
        "true_slope": true_track.slope,
        "slope": made_track.slope,
        "true_bend": true_track.bend,
        "bend": made_track.bend,
    }


def cost(truth: Truth, photo: FloatImage) -> tuple[float, float, float]:
    """Processor milliseconds: preparing the maps, shading a view, and making a view, all of LARGE squared pixels."""
    times = -(-LARGE // truth.disparity.shape[0])
    factor = float(times)
    disparity = np.kron(truth.disparity, np.ones((times, times), np.float32))
    large = np.kron(photo, np.ones((times, times, 1), np.float32))
    geometry = replace(truth.geometry, focal_px=truth.geometry.focal_px * factor)
    maps = make_gloss_maps(truth.gloss, large, disparity, geometry)
    colors = large.copy()
    shade(colors, disparity, ViewOffset(1.0, 1.0), maps)
    start = time.process_time()
    make_gloss_maps(truth.gloss, large, disparity, geometry)
    prepared = time.process_time()
    shade(colors, disparity, ViewOffset(1.0, 1.0), maps)
    shaded = time.process_time()
    picture, map_ = Photo(large, geometry.focal_px, "truth"), Disparity(disparity, "truth")
    views = list(generate(picture, map_, plan_literal(picture, map_, truth.grid)))
    made = (time.process_time() - shaded) / len(views)
    return 1e3 * (prepared - start), 1e3 * (shaded - prepared), 1e3 * made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--truth", type=Path, required=True, help="folder written by benchmarks.gloss_scenes")
    parser.add_argument("--out", type=Path, help="report to write")
    args = parser.parse_args()
    for name in SCENES:
        truth = read(args.truth / f"{name}.npz")
        matt_photo = np.clip(srgb_from_linear(truth.matt_views[2, 2]), 0, 1)
        shining_photo = np.clip(srgb_from_linear(truth.views[2, 2]), 0, 1)
        for case, photo, gloss in (
            ("given", matt_photo, truth.gloss),
            ("found", shining_photo, replace(truth.gloss, light=DARK, photo_shines=True)),
        ):
            print(name, case, {k: round(v, 3) for k, v in judge(truth, photo, gloss).items()})
    print(cost(truth, matt_photo))


if __name__ == "__main__":
    main()
