"""The real window on a private X server: first picture, all views, dragging, idling.

python -m benchmarks.window [--apertures 0,4] [--idle 5] [--cold]

A frame's time is that of the processor, in the thread that draws. --cold: as if the graphics driver had compiled no
shader before.
Dragged is with 60 pointer moves a second. Latency is counted from the turn of the loop that reads a pointer move to the
frame that shows its viewpoint, both included.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import psutil

from benchmarks.harness.bench_scenes import DEMO
from benchmarks.harness.real_window import open_window, run_until_idle
from benchmarks.harness.reports import emit, head, holds, parser_of, row, start
from benchmarks.harness.turn_times import watched_turns
from iibr_core.scenes.scene import Source
from iibr_core.types import ViewOffset
from viewer.app.main_loop import App
from viewer.model.state.optics_actions import SetAperture

MOVES = 150
STEP_PX = 2
EVERY_S = 1 / 60


@dataclass(frozen=True)
class Drag:
    """Measurements of one drag.

    latency_frames, latency_ms: of each viewpoint shown. draw_ms: of each picture. left_over: frames after the last move
    until the picture had caught up.
    """

    latency_frames: list[int]
    latency_ms: list[float]
    draw_ms: list[float]
    left_over: int


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--apertures", default="0,4")
    parser.add_argument("--idle", type=float, default=5.0, help="seconds")
    parser.add_argument("--cold", action="store_true")
    options = parser.parse_args()
    if options.cold:
        os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    began = time.perf_counter(), time.process_time()
    with open_window(Source(str(DEMO))) as app:
        emit(report(app, began, [float(aperture) for aperture in options.apertures.split(",")], options.idle))


def report(app: App, began: tuple[float, float], apertures: list[float], idle_s: float) -> Iterator[str]:
    """began: on the clock, and of processor time."""
    view = app.scene_view
    yield head("what", "figure", "measured", "holds")
    with watched_turns(app) as turns:
        while view.pictures_drawn == 0:
            app.step()
        first = time.perf_counter(), time.process_time()
        torch = "torch" in sys.modules
        yield row("first picture", "without torch", since(began), holds(not torch))
        while view.views_uploaded < 2:
            app.step()
        yield row("second view, after it", "", since(first), "")
        run_until_idle(app)
    shown = f"{app.frames_shown} frames shown, {view.pictures_drawn} pictures drawn"
    yield row(f"all {app.state.progress.total} views", "", f"{since(began)}, {shown}", "")
    yield row("longest frame until then", "", f"{turns.longest}", "")
    for aperture in apertures:
        app.do(SetAperture(aperture))
        run_until_idle(app)
        yield drag_row(aperture, drag(app), app)
        run_until_idle(app)
    process, frames = psutil.Process(), app.frames_shown
    before, rested = process.cpu_times(), time.perf_counter()
    while time.perf_counter() - rested < idle_s:
        app.step()
    after, frames = process.cpu_times(), app.frames_shown - frames
    used = (after.user + after.system - before.user - before.system) / idle_s
    yield row(f"idle for {idle_s:g} s", "no frames", f"{frames} frames, {used:.2%} of a core", holds(frames == 0))


def since(began: tuple[float, float]) -> str:
    """began: on the clock, and of processor time."""
    return f"{time.perf_counter() - began[0]:.2f} s, {time.process_time() - began[1]:.2f} s of processor time"


def drag(app: App) -> Drag:
    """Drag to and fro over the picture and watch when what was read is shown."""
    picture = app.layout().picture
    assert picture is not None
    x, y = round(picture.x + picture.width / 2), round(picture.y + picture.height / 2)
    moves = [["mousemove", str(x), str(y), "mousedown", "1"]]
    for k in range(MOVES):
        to = x + STEP_PX * (abs((k + 30) % 120 - 60) - 30)
        moves.append(["mousemove", str(to), str(y + k % 7), "sleep", f"{EVERY_S:.4f}"])
    hand = subprocess.Popen(["xdotool", *(word for move in moves for word in move)])
    waiting: dict[ViewOffset, tuple[int, float]] = {}
    frames, milliseconds, draws, turn = [], [], [], 0
    while hand.poll() is None:
        turn += 1
        eye, drawn, began = app.state.optics.eye, app.scene_view.pictures_drawn, time.perf_counter()
        app.step()
        shown = app.scene_view.picture_drawn
        if shown is not None and shown.optics.eye in waiting:
            since, read_at = waiting[shown.optics.eye]
            waiting = {other: read for other, read in waiting.items() if read[0] > since}
            frames.append(turn - since + 1)
            milliseconds.append((time.perf_counter() - read_at) * 1e3)
        if app.scene_view.pictures_drawn > drawn:
            draws.append(app.scene_view.renderer.report.draw_ms)
        if app.state.optics.eye != eye:
            waiting[app.state.optics.eye] = turn, began
    left_over = 0
    while app.scene_view.picture_drawn is None or app.scene_view.picture_drawn.optics.eye != app.state.optics.eye:
        app.step()
        left_over += 1
    subprocess.run(["xdotool", "mouseup", "1"], check=True)
    return Drag(frames, milliseconds, draws, left_over)


def drag_row(aperture: float, seen: Drag, app: App) -> str:
    picture = app.layout().picture
    assert picture is not None
    what = f"dragging, picture {picture.width:.0f}x{picture.height:.0f}, aperture {aperture:g}"
    worst, latency, draws = max(seen.latency_frames), seen.latency_ms, seen.draw_ms
    said = (
        f"{worst} frames, {np.median(latency):.0f} ms (90 %: {np.quantile(latency, 0.9):.0f}); pictures"
        f" {np.median(draws):.0f} ms (90 %: {np.quantile(draws, 0.9):.0f}); {seen.left_over} frames behind at the end"
    )
    return row(what, "latency <= 2 frames, no queue", said, holds(worst <= 2 and seen.left_over <= 2))


if __name__ == "__main__":
    start("benchmarks.window", main)
