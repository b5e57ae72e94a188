"""Processor time of making fields, in turns with a plain warp of the same views, on one thread.

    python -m benchmarks.against_warp [--data DATA] [--only NAME,...] [--repeats 3]

Scenes of DATA are made with 9 x 9 views at their own disparity; the demo photo comes along, with the parallax that the
plan gives it. The warp is `benchmarks.peers.warp`: forward, holes filled from the background. Edges: the share of the
default's time, refining the map and making the views in the plan's quality, that goes into refining and into splitting
mixed pixels. Look-ups: what a view of the first quality takes, in times of looking every pixel of the photo up by Keys'
kernel. Two threads: the default's views by the clock, as many times as fast as on one. All are medians over rounds of
what was taken in the same round: other programs disturb them little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import cv2
import numpy as np

from benchmarks.harness.bench_scenes import FIELD, BenchScene, data_scenes, offsets_of, photo_scene
from benchmarks.harness.reports import emit, head, is_wanted, parser_of, row, start
from benchmarks.harness.timing import Cost, cost_of, in_turns, make_field, median_cost, median_ratio, process_of
from benchmarks.peers import warp
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges.refine import refine
from iibr_core.method.farthest_views import farthest_views, outer_views
from iibr_core.method.look_up import cubic
from iibr_core.method.mixed_pixels import split_mixed_pixels
from iibr_core.method.plan import plan_literal
from iibr_core.runtime.kernels import kernel
from iibr_core.surfaces import EDGE_PX, step_of
from iibr_core.types import FloatImage, Quality

REFINING, SPLITTING, WARP, LOOK_UP = "refining", "splitting", "warp", "look-up"


def main() -> None:
    parser = parser_of(__doc__, "data", "only", "repeats")
    parser.add_argument("--qualities", default="fast,balanced")
    options = parser.parse_args()
    qualities = options.qualities.split(",")
    wanted = (found for found in scenes(options.data) if is_wanted(found[0].name, options.only))
    rows = (compare(*found, qualities, options.repeats) for found in wanted)
    ratios = (f"{quality}, times the warp" for quality in qualities)
    figures = "a view, look-ups", "edges, %", "two threads, times as fast"
    emit(chain([head("scene", "the plan's", "warp, s", *ratios, *figures)], rows))


def scenes(data: Path | None) -> Iterator[tuple[BenchScene, FloatImage]]:
    """The demo photo, and those of a folder, with refined maps; the maps as they were."""
    demo, given = photo_scene(), photo_scene(choice=DepthChoice(refine=0.0))
    assert demo is not None
    assert given is not None
    yield demo, given.disparity
    for scene in data_scenes(data, with_soft=False):
        field = offsets_of(FIELD)
        yield replace(scene, disparity=refine(scene.photo, scene.disparity), truth={}, field=field), scene.disparity


def compare(scene: BenchScene, given: FloatImage, qualities: Sequence[Quality], repeats: int) -> str:
    """A line of the table."""
    planned = plan_literal(*scene.given, scene.grid).quality
    with process_of(1) as one, process_of(2) as two:
        costs = one.submit(_alone, scene, given, list(dict.fromkeys((*qualities, planned))), repeats).result()
        processes = {"one": one, "two": two}
        ways = {name: partial(_field_cost, process, scene, planned) for name, process in processes.items()}
        for way in ways.values():  # compiles
            way()
        clock = in_turns(ways, repeats)
    ratios = (f"{median_ratio(costs[quality], costs[WARP]):.2f}" for quality in qualities)
    edges = _sums(costs[REFINING], costs[SPLITTING]), _sums(costs[REFINING], costs[planned])
    faster = np.median([slow.wall_s / quick.wall_s for slow, quick in zip(clock["one"], clock["two"])])
    warp_s = f"{median_cost(costs[WARP]).cpu_s:.2f}"
    look_ups = f"{median_ratio(costs[qualities[0]], costs[LOOK_UP]) / len(scene.field):.1f}"
    return row(scene.name, planned, warp_s, *ratios, look_ups, f"{100 * median_ratio(*edges):.0f}", f"{faster:.2f}")


def _alone(scene: BenchScene, given: FloatImage, qualities: list[Quality], repeats: int) -> dict[str, list[Cost]]:
    """What the warp, each quality and the work at edges cost in this process."""
    cv2.setNumThreads(1)
    view = warp.prepare(scene.photo, scene.disparity)
    edge_step = step_of(EDGE_PX, farthest_views(outer_views(scene.field)))
    works: dict[str, Callable[[], object]] = {
        WARP: lambda: [view(at) for at in scene.field],
        REFINING: partial(refine, scene.photo, given),
        LOOK_UP: partial(_look_up, np.ascontiguousarray(scene.photo[None]), np.empty_like(scene.photo)),
        SPLITTING: partial(split_mixed_pixels, scene.photo, scene.disparity, edge_step),
        **{quality: partial(make_field, scene, quality) for quality in qualities},
    }
    ways = {name: partial(cost_of, work) for name, work in works.items()}
    in_turns(ways, 1)  # compiles
    return in_turns(ways, repeats)


@kernel
def _look_up(images, shown):
    """Every pixel of the first image, looked up beside its place."""
    for y in range(shown.shape[0]):
        for x in range(shown.shape[1]):
            shown[y, x, 0], shown[y, x, 1], shown[y, x, 2] = cubic(images, 0, x + 0.3, y + 0.6)


def _field_cost(process: ProcessPoolExecutor, scene: BenchScene, quality: Quality) -> Cost:
    return process.submit(cost_of, partial(make_field, scene, quality)).result()


def _sums(some: list[Cost], others: list[Cost]) -> list[Cost]:
    return [one + other for one, other in zip(some, others)]


if __name__ == "__main__":
    start("benchmarks.against_warp", main)
