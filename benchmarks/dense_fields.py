"""Views between those of a sparse light field: how near they come to the views left out, against what is simpler.

    python -m benchmarks.dense_fields [--data FOLDER] [--scenes 0] [--step 4] [--judged 12]

FOLDER is a light field; every STEPth row and column of it is given (--step 8 of 9x9: the corners), some of the others
are judged. Scenes are drawn like those that training learns from, by seeds of their own. Beside ours: the given view
nearest to the centre alone, with its map, by `generate`; and the given views around, each warped plainly with its own
map and averaged by how near they are. Processor time: of all maps, and of a view.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.provenance import made_by
from benchmarks.refocus import read_views
from iibr_core.color import bytes_from_encoded, encoded_from_stored
from iibr_core.depth.multi_view.estimate import estimate_coarse
from iibr_core.depth.multi_view.every_view import estimate_all
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.generation.dense_field import GivenView, densify
from iibr_core.generation.view_maker import ViewMaker
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import FloatImage, GridShape, ImageSize, ViewOffset

SCENE_GRID, SCENE_SIZE = GridShape(9, 9), ImageSize(288, 384)
FIRST_SEED = 7000
DISPARITIES_PX = (0.4, 2.0)
"""Largest disparities of the scenes, px per view step."""

Views = NDArray[np.uint8]
"""Of a light field: (V, U, H, W, 3)."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--scenes", type=int, default=0)
    parser.add_argument("--step", type=int, default=4)
    parser.add_argument("--judged", type=int, default=12)
    options = parser.parse_args()
    print(f"{made_by('benchmarks.dense_fields')}; two cores")
    print(f"{'':16} ours   centre alone   plain blend   (dB)   s of processor time: maps, a view")
    for name, views in _fields(options.data, options.scenes):
        _judge(name, views, options.step, options.judged)


def _fields(data: Path | None, scenes: int) -> Iterator[tuple[str, Views]]:
    if data is not None:
        grid, flat = read_views(data)
        yield data.name, flat.reshape(*grid, *flat.shape[1:])
    for seed in range(FIRST_SEED, FIRST_SEED + scenes):
        rng = np.random.default_rng(seed)
        scene = random_scene(rng, SCENE_SIZE, float(np.exp(rng.uniform(*np.log(DISPARITIES_PX)))))
        drawn = [
            bytes_from_encoded(render(scene, SCENE_SIZE, SCENE_GRID.offset(*at))[0]) for at in np.ndindex(*SCENE_GRID)
        ]
        yield f"scene {seed}", np.array(drawn).reshape(*SCENE_GRID, *SCENE_SIZE, 3)


def _judge(name: str, views: Views, step: int, judged: int) -> None:
    dense = GridShape(*views.shape[:2])
    sparse = GridShape(*views[::step, ::step].shape[:2])
    places = [(step * v, step * u) for v, u in np.ndindex(*sparse)]
    left_out = [at for at in np.ndindex(*dense) if at not in places]
    chosen = [left_out[k] for k in np.random.default_rng(0).choice(len(left_out), min(judged, len(left_out)), False)]
    start = time.process_time()
    maps = _maps([views[at] for at in places], [dense.offset(*at) for at in places])
    finding = time.process_time() - start
    given = [GivenView(v // step, u // step, views[v, u], values * step) for (v, u), values in zip(places, maps)]
    _warm_up(given, sparse, dense)
    start = time.process_time()
    made = {(view.row, view.column): encoded_from_stored(view.colors) for view in densify(given, sparse, dense)}
    each = (time.process_time() - start) / len(left_out)
    centre = places.index((step * sparse.centre[0], step * sparse.centre[1]))
    alone = _alone(views[places[centre]], maps[centre], dense.offset(*places[centre]), dense, chosen)
    sources = [(dense.offset(*at), encoded_from_stored(views[at]), values) for at, values in zip(places, maps)]

    def mean(picture: Callable[[tuple[int, int]], FloatImage]) -> float:
        return float(np.mean([bounded_psnr(picture(at), encoded_from_stored(views[at])) for at in chosen]))

    ours, one, plain = mean(made.__getitem__), mean(alone.__getitem__), mean(
        lambda at: _plain_blend(sources, dense.offset(*at), step)
    )  # fmt: skip
    print(
        f"{name:16} {ours:5.2f}  {one:5.2f}          {plain:5.2f}                {finding:.0f}, {each:.3f}", flush=True
    )


def _maps(views: list[NDArray[np.uint8]], offsets: list[ViewOffset]) -> list[FloatImage]:
    return estimate_all(views, offsets, estimate_coarse(views, offsets, len(views) // 2).range_px)


def _warm_up(given: list[GivenView], sparse: GridShape, dense: GridShape) -> None:
    """Compile what a small part of the field needs."""
    part = [GivenView(view.row, view.column, view.colors[:48, :64], view.disparity[:48, :64]) for view in given]
    list(densify(part, sparse, dense))


def _alone(
    colors: NDArray[np.uint8], values: FloatImage, at: ViewOffset, dense: GridShape, chosen: list[tuple[int, int]]
) -> dict[tuple[int, int], FloatImage]:
    """The chosen views, from one given view in `generate`'s balanced quality."""
    offsets = [ViewOffset(to.t - at.t, to.s - at.s) for to in (dense.offset(*place) for place in chosen)]
    with ViewMaker(encoded_from_stored(colors), values, offsets, ("balanced",)) as maker:
        return {place: maker.view("balanced", offset).colors for place, offset in zip(chosen, offsets)}


def _plain_blend(sources: list[tuple[ViewOffset, FloatImage, FloatImage]], to: ViewOffset, step: int) -> FloatImage:
    """The reference warps of the given views around, averaged by nearness where they have no hole."""
    total, weights = np.zeros_like(sources[0][1]), np.zeros(sources[0][2].shape, np.float32)
    for at, colors, values in sources:
        away = ViewOffset(to.t - at.t, to.s - at.s)
        near = max(1 - abs(away.t) / step, 0) * max(1 - abs(away.s) / step, 0)
        if near > 0:
            warped = reference_warp(colors, values, away)
            # Holes count only where nobody sees anything.
            weight = np.where(warped.hole, np.float32(1e-6), np.float32(near))
            total += weight[..., None] * warped.colors
            weights += weight
    return total / weights[..., None]


if __name__ == "__main__":
    main()
