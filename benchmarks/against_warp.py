"""Processor time of making fields, in turns with a plain warp of the same views, on one thread.

    python -m benchmarks.against_warp [--data DATA] [--only NAME,...] [--repeats 3]

Scenes of DATA are made with 9 x 9 views at their own disparity; the demo photo comes along, with the parallax that the
plan gives it. The warp is `benchmarks.peers.warp`: forward, holes filled from the background. Edges: the share of the
time of refining the map and making the views that goes into refining and into splitting mixed pixels. Look-ups: what a
view takes, in times of looking every pixel of the photo up by Keys' kernel. Two threads: the views by the clock, as
many times as fast as on one. All are medians over rounds of what was taken in the same round: other programs disturb
them little.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
from iibr_core.runtime.kernels import kernel
from iibr_core.surfaces import EDGE_PX, step_of
from iibr_core.types import FloatImage

REFINING, SPLITTING, WARP, LOOK_UP, MAKING = "refining", "splitting", "warp", "look-up", "making"


def main() -> None:
    parser = parser_of(__doc__, "data", "only", "repeats")
    options = parser.parse_args()
    wanted = (found for found in scenes(options.data) if is_wanted(found[0].name, options.only))
    rows = (compare(*found, options.repeats) for found in wanted)
    figures = "iibr, times the warp", "a view, look-ups", "edges, %", "two threads, times as fast"
    emit(chain([head("scene", "warp, s", *figures)], rows))


def scenes(data: Path | None) -> Iterator[tuple[BenchScene, FloatImage]]:
    """The demo photo, and those of a folder, with refined maps; the maps as they were."""
    demo, given = photo_scene(), photo_scene(choice=DepthChoice(refine=False))
    assert demo is not None
    assert given is not None
    yield demo, given.disparity
    for scene in data_scenes(data, with_soft=False):
        field = offsets_of(FIELD)
        yield replace(scene, disparity=refine(scene.photo, scene.disparity), truth={}, field=field), scene.disparity


def compare(scene: BenchScene, given: FloatImage, repeats: int) -> str:
    """Return a line of the table."""
    with process_of(1) as one, process_of(2) as two:
        costs = one.submit(_on_one_thread, scene, given, repeats).result()
        ways = {name: partial(_field_cost, process, scene) for name, process in {"one": one, "two": two}.items()}
        for way in ways.values():  # compiles
            way()
        clock = in_turns(ways, repeats)
    edges = _sums(costs[REFINING], costs[SPLITTING]), _sums(costs[REFINING], costs[MAKING])
    faster = np.median([slow.wall_s / quick.wall_s for slow, quick in zip(clock["one"], clock["two"])])
    warp_s, ratio = median_cost(costs[WARP]).cpu_s, median_ratio(costs[MAKING], costs[WARP])
    look_ups = median_ratio(costs[MAKING], costs[LOOK_UP]) / len(scene.field)
    edge_share = f"{100 * median_ratio(*edges):.0f}"
    return row(scene.name, f"{warp_s:.2f}", f"{ratio:.2f}", f"{look_ups:.1f}", edge_share, f"{faster:.2f}")


def _on_one_thread(scene: BenchScene, given: FloatImage, repeats: int) -> dict[str, list[Cost]]:
    """Return what the warp, the field and the work at edges cost in this process."""
    cv2.setNumThreads(1)
    view = warp.prepare(scene.photo, scene.disparity)
    edge_step = step_of(EDGE_PX, farthest_views(outer_views(scene.field)))
    works: dict[str, Callable[[], object]] = {
        WARP: lambda: [view(at) for at in scene.field],
        REFINING: partial(refine, scene.photo, given),
        LOOK_UP: partial(_look_up, np.ascontiguousarray(scene.photo[None]), np.empty_like(scene.photo)),
        SPLITTING: partial(split_mixed_pixels, scene.photo, scene.disparity, edge_step),
        MAKING: partial(make_field, scene),
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


def _field_cost(process: ProcessPoolExecutor, scene: BenchScene) -> Cost:
    return process.submit(cost_of, partial(make_field, scene)).result()


def _sums(some: list[Cost], others: list[Cost]) -> list[Cost]:
    return [one + other for one, other in zip(some, others)]


if __name__ == "__main__":
    start("benchmarks.against_warp", main)
