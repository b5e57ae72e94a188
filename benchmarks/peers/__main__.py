"""Time against error beside what people use instead: the same photo, map and views. Writes peers.md and peers.svg.

    python -m benchmarks.peers --data DATA --out DIR [--only SCENE,...] [--repeats 3] [--quick]

--quick: no tables for threads and pixels.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.harness.bench_scenes import BenchScene, data_scenes, require_scenes
from benchmarks.harness.plots import Panel, on_the_front, plot_panels
from benchmarks.harness.reports import head, is_wanted, parser_of, row, start, title
from benchmarks.harness.timing import Cost, cost_of, in_turns, median_cost, median_ratio
from benchmarks.peers import planes, ray_march, splatting, warp
from benchmarks.peers.scaling import pixel_lines, thread_lines
from benchmarks.speed.variants import Variant, evaluated_views, field_cost
from benchmarks.stages import judge_view
from iibr_core.evaluation.metrics import flip, ssim
from iibr_core.evaluation.warp import reference_warp
from iibr_core.formats.outputs import write_file
from iibr_core.runtime.work import report_progress
from iibr_core.stages import stages_without
from iibr_core.types import FloatImage, ViewOffset
from viewer.cli.terminal import show_progress

Prepare = Callable[[FloatImage, FloatImage], Callable[[ViewOffset], FloatImage]]
ABOUT = """Every way gets the map as it comes; what it makes of it once is part of its time. Peers run on one thread,
ours on all of the machine's; processor time counts."""
TIMED_VIEWS = 4
WARP = "plain warp"


PEERS: Mapping[str, Prepare] = {
    WARP: warp.prepare,
    "ray march (DepthFlow)": ray_march.prepare,
    "dilated forward warp (iw3)": splatting.prepare_dilated,
    "softmax splatting": splatting.prepare,
    "32 planes (MPI)": planes.prepare,
}
OURS = {
    "iibr": Variant("iibr"),
    "iibr, no ray transformer": Variant("no ray transformer", stages=stages_without(["ray-transformer"])),
    "iibr, half width": Variant("half width", shrink=2),
    "iibr, quarter width": Variant("quarter width", shrink=4),
}


@dataclass(frozen=True)
class Result:
    """One way on one scene: seconds of its whole field; ratio to the plain warp's; means over the judged views."""

    name: str
    seconds: float
    ratio: float
    psnr_db: float
    ssim: float
    flip: float
    flying: float


def main() -> None:
    out = {"required": True, "metavar": "DIR", "help": "folder to write to"}
    parser = parser_of(__doc__, "data", "only", "repeats", out=out)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    scenes = require_scenes(options.data, list(data_scenes(options.data, with_soft=False)))
    scenes = [scene for scene in scenes if is_wanted(scene.name, options.only)]
    with show_progress("measuring"):
        found = {}
        for k, scene in enumerate(scenes):
            report_progress(k, len(scenes), scene.name)
            found[scene.name] = measure(scene, options.repeats)
        report_progress(len(scenes), len(scenes), "threads and pixels")
        scaling = [] if options.quick else [*thread_lines(options.repeats), *pixel_lines(options.repeats)]
    lines = [*report(found), *scaling]
    _write(options.out / "peers.md", ("\n".join(lines) + "\n").encode())
    panels = [Panel(name, gains(rows), WARP) for name, rows in found.items()]
    _write(options.out / "peers.svg", plot_panels(panels, "svg"))


def measure(scene: BenchScene, repeats: int) -> list[Result]:
    """Every way on one scene, timed in turns."""
    views = {name: _views_of(prepare, scene) for name, prepare in PEERS.items()}
    views |= {name: evaluated_views(variant, scene) for name, variant in OURS.items()}
    ways = {name: partial(_peer_cost, prepare, scene) for name, prepare in PEERS.items()}
    ways |= {name: partial(field_cost, variant, scene) for name, variant in OURS.items()}
    costs = in_turns(ways, repeats)
    holes = {at: reference_warp(scene.photo, scene.disparity, at).hole for at in scene.truth}
    results = []
    for name, made in views.items():
        each = [
            (*judge_view(made[at], truth, holes[at])[::3][:2], ssim(made[at], truth), flip(made[at], truth))
            for at, truth in scene.truth.items()
        ]
        psnr_db, flying, likeness, difference = np.nanmean(each, axis=0)
        own, ratio = median_cost(costs[name]).cpu_s, median_ratio(costs[name], costs[WARP])
        results.append(Result(name, own, ratio, psnr_db, likeness, difference, flying))
    return results


def _views_of(prepare: Prepare, scene: BenchScene) -> dict[ViewOffset, FloatImage]:
    view = prepare(scene.photo, scene.disparity)
    return {at: np.clip(view(at), 0, 1).astype(np.float32) for at in scene.truth}


def _peer_cost(prepare: Prepare, scene: BenchScene) -> Cost:
    """Return the cost of the whole field, from setting up and from a few views, spread over it."""
    kept: list[Callable[[ViewOffset], FloatImage]] = []
    setting_up = cost_of(lambda: kept.append(prepare(scene.photo, scene.disparity)))
    places = [scene.field[round(k)] for k in np.linspace(0, len(scene.field) - 1, TIMED_VIEWS)]
    views = cost_of(lambda: [(255 * kept[0](at) + 0.5).astype(np.uint8) for at in places])
    return setting_up + views.times((len(scene.field) - 1) / len(places))


def gains(rows: list[Result]) -> dict[str, tuple[float, float]]:
    """Time and gain of each way against the plain warp."""
    plain = next(one for one in rows if one.name == WARP)
    return {one.name: (one.ratio, one.psnr_db - plain.psnr_db) for one in rows}


def report(found: Mapping[str, list[Result]]) -> Iterator[str]:
    """A table a scene, and who is ahead of ours in both time and PSNR."""
    yield title("Beside other ways", "benchmarks.peers", ABOUT)
    for name, rows in found.items():
        yield f"\n## {name}\n"
        yield head("way", "s of processor time", "times the plain warp", "PSNR, dB", "SSIM", "FLIP", "flying pixels")
        front = on_the_front({one.name: (one.ratio, one.psnr_db) for one in rows})
        for one in rows:
            label = f"**{one.name}**" if one.name in front else one.name
            figures = (f"{one.psnr_db:.2f}", f"{one.ssim:.4f}", f"{one.flip:.4f}", f"{one.flying:.1f}")
            yield row(label, f"{one.seconds:.2f}", f"{one.ratio:.2f}", *figures)
        ahead = [
            f"{peer.name} (of {own.name})"
            for own in rows
            for peer in rows
            if own.name in OURS and peer.name in PEERS and peer.ratio <= own.ratio and peer.psnr_db >= own.psnr_db
        ]
        yield f"\nBold: none is both faster and better. Ahead of ours in both: {', '.join(ahead) or 'none'}."


def _write(path: Path, content: bytes) -> None:
    with write_file(path) as unfinished:
        unfinished.write_bytes(content)
    print(os.fspath(path))


if __name__ == "__main__":
    start("benchmarks.peers", main)
