"""Processor time of making fields, in turns with a plain warp of the same views, in one process.

    python -m benchmarks.against_warp [--data DATA] [--only NAME,...] [--repeats 3]

Scenes of DATA are made with 9 x 9 views at their own disparity; the demo photo comes along, with the parallax that the
plan gives it. The warp is `benchmarks.peers.warp`. Ratios are medians over rounds: other programs disturb
them little.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

from benchmarks.harness.bench_scenes import FIELD, BenchScene, data_scenes, offsets_of, photo_scene
from benchmarks.harness.reports import emit, head, is_wanted, parser_of, row, start
from benchmarks.harness.timing import cost_of, in_turns, make_field, median_cost, median_ratio
from benchmarks.peers import warp
from iibr_core.depth.edges.refine import refine
from iibr_core.generation.plan import plan_literal
from iibr_core.types import Quality


def main() -> None:
    parser = parser_of(__doc__, "data", "only", "repeats")
    parser.add_argument("--qualities", default="fast,balanced")
    options = parser.parse_args()
    qualities = options.qualities.split(",")
    wanted = (scene for scene in scenes(options.data) if is_wanted(scene.name, options.only))
    rows = (compare(scene, qualities, options.repeats) for scene in wanted)
    emit(
        chain([head("scene", "the plan's", "warp, s", *(f"{quality}, times the warp" for quality in qualities))], rows)
    )


def scenes(data: Path | None) -> Iterator[BenchScene]:
    """The demo photo, and those of a folder with refined maps."""
    demo = photo_scene()
    assert demo is not None
    yield demo
    for scene in data_scenes(data, with_soft=False):
        yield replace(scene, disparity=refine(scene.photo, scene.disparity), field=offsets_of(FIELD))


def compare(scene: BenchScene, qualities: list[Quality], repeats: int) -> str:
    """A line of the table."""
    view = warp.prepare(scene.photo, scene.disparity)

    def warp_all() -> None:
        for at in scene.field:
            view(at)

    for quality in qualities:  # compiles
        make_field(scene, quality)
    view(scene.field[0])
    ways = {"warp": warp_all, **{quality: partial(make_field, scene, quality) for quality in qualities}}
    costs = in_turns({name: partial(cost_of, way) for name, way in ways.items()}, repeats)
    ratios = (f"{median_ratio(costs[quality], costs['warp']):.2f}" for quality in qualities)
    planned = plan_literal(*scene.given, scene.grid).quality
    return row(scene.name, planned, f"{median_cost(costs['warp']).cpu_s:.2f}", *ratios)


if __name__ == "__main__":
    start("benchmarks.against_warp", main)
