"""Dragging in the real window on a private X server, 60 pointer moves a second, and then nothing at all.

python -m benchmarks.dragging [--apertures 0,4] [--idle 3]

Prints lines of a Markdown table. Latency is counted from the turn of the loop that reads a pointer move to the frame
that shows its viewpoint, both included.
"""

from __future__ import annotations

import argparse
import subprocess
import time
from dataclasses import dataclass

import numpy as np

from iibr_core.runtime.resources import resource_folder
from iibr_core.types import ViewOffset
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.model.actions import OpenPath
from viewer.model.state.optics import SetAperture
from viewer.model.state.scene import Source

MOVES = 150
STEP_PX = 2
EVERY_S = 1 / 60


@dataclass(frozen=True)
class Drag:
    """What was seen of one drag.

    latency_frames, latency_ms: of each viewpoint shown. draw_ms: of each picture. left_over: frames after the last move
    until the picture had caught up.
    """

    latency_frames: list[int]
    latency_ms: list[float]
    draw_ms: list[float]
    left_over: int


def drag(app: App) -> Drag:
    """Drag to and fro over the picture and watch when what was read is shown."""
    picture = app.layout().picture
    assert picture is not None
    x, y = round(picture.x + picture.width / 2), round(picture.y + picture.height / 2)
    moves = [["mousemove", str(x), str(y), "mousedown", "1"]]
    for k in range(MOVES):
        to = x + STEP_PX * (abs((k + 30) % 120 - 60) - 30)
        moves.append(["mousemove", str(to), str(y + k % 7), "sleep", f"{EVERY_S:.4f}"])
    command = ["xdotool", *(word for move in moves for word in move)]
    hand = subprocess.Popen(command)
    waiting: dict[ViewOffset, tuple[int, float]] = {}
    frames, milliseconds, draws, turn = [], [], [], 0
    while hand.poll() is None:
        turn += 1
        eye, drawn, start = app.state.optics.eye, app.scene_view.pictures_drawn, time.perf_counter()
        app.step()
        shown = app.scene_view.picture_drawn
        if shown is not None and shown.optics.eye in waiting:
            since, read_at = waiting[shown.optics.eye]
            waiting = {other: read for other, read in waiting.items() if read[0] > since}
            frames.append(turn - since + 1)
            milliseconds.append((time.perf_counter() - read_at) * 1e3)
        if app.scene_view.pictures_drawn > drawn:
            draws.append(app.scene_view.report.draw_ms)
        if app.state.optics.eye != eye:
            waiting[app.state.optics.eye] = turn, start
    left_over = 0
    while app.scene_view.picture_drawn is None or app.scene_view.picture_drawn.optics.eye != app.state.optics.eye:
        app.step()
        left_over += 1
    subprocess.run(["xdotool", "mouseup", "1"], check=True)
    return Drag(frames, milliseconds, draws, left_over)


def settle(app: App) -> None:
    """Turn the loop until every view is there and nothing is left to do."""
    while not (app.state.progress.is_complete and app.wait_s > 0):
        app.step()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--apertures", default="0,4")
    parser.add_argument("--idle", type=float, default=3.0, help="seconds")
    args = parser.parse_args()
    photo = resource_folder("assets") / "motorcycle" / "motorcycle.png"
    with private_display():
        app = App(initial_state(OpenPath(Source(str(photo)))))
        try:
            settle(app)
            for aperture in map(float, args.apertures.split(",")):
                app.do(SetAperture(aperture))
                settle(app)
                print(row(aperture, drag(app), app), flush=True)
                settle(app)
            print(idle_row(app, args.idle), flush=True)
        finally:
            app.close()


def row(aperture: float, seen: Drag, app: App) -> str:
    """A line about a drag."""
    picture = app.layout().picture_px
    assert picture is not None
    size = f"{picture[2]}x{picture[3]}"
    return (
        f"| dragging in the window, 60 moves a second, picture {size}, aperture {aperture:g} | latency <= 2 frames, no"
        f" queue | {max(seen.latency_frames)} frames, {np.median(seen.latency_ms):.0f} ms (90 %:"
        f" {np.quantile(seen.latency_ms, 0.9):.0f}); pictures {np.median(seen.draw_ms):.0f} ms (90 %:"
        f" {np.quantile(seen.draw_ms, 0.9):.0f}); {seen.left_over} frames behind at the end |"
    )


def idle_row(app: App, seconds: float) -> str:
    """A line about doing nothing."""
    settle(app)
    frames, start = app.frames_shown, time.perf_counter()
    while time.perf_counter() - start < seconds:
        app.step()
    return f"| idle for {seconds:g} s | no frames | {app.frames_shown - frames} frames |"


if __name__ == "__main__":
    main()
