"""Time the real window on a private X server: first picture, all views, dragging, idling.

    python -m benchmarks window [--idle 5] [--cold]

A frame's time is that of the processor, in the thread that draws. Drags make 60 pointer moves a second; latency is
counted from the turn of the loop that reads a move to the frame that shows its viewpoint, both included. --cold: as if
the graphics driver had compiled no shader before.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import time
from collections.abc import Callable, Iterator

import numpy as np
import psutil

from benchmarks.report import markdown
from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Source
from iibr_core.types import ViewOffset
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.model import lens
from viewer.model.action import do

DEMO = resource_folder("assets") / "motorcycle" / "motorcycle.png"


def main() -> None:
    """Open the demo photo in a window and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--idle", type=float, default=5.0, help="seconds")
    parser.add_argument("--cold", action="store_true")
    options = parser.parse_args()
    if options.cold:
        os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    began = time.perf_counter(), time.process_time()
    with private_display():
        app = App(initial_state(Source(str(DEMO))))
        try:
            print(markdown(("what", "measured"), rows(app, began, options.idle)))
        finally:
            app.close()


def rows(app: App, began: tuple[float, float], idle_s: float) -> Iterator[tuple[str, str]]:
    """Yield the rows of the table. began: times by the clock and of the processor."""
    first = step_while(app, lambda: app.scene_view.pictures_drawn == 0)
    yield "first picture", since(began)
    rest = step_while(app, lambda: not is_idle(app))
    pictures = f"{app.frames_shown} frames shown, {app.scene_view.pictures_drawn} pictures drawn"
    yield f"all {app.state.progress.total} views", f"{since(began)}; {pictures}"
    yield "longest frame until then", f"{1e3 * max(first, rest):.0f} ms of processor time"
    for aperture in (0, 4):
        app.do(do(lens.set_aperture, aperture))
        step_while(app, lambda: not is_idle(app))
        yield f"dragging, aperture of {aperture} view steps", drag(app)
        step_while(app, lambda: not is_idle(app))
    before, frames, rested = psutil.Process().cpu_times(), app.frames_shown, time.perf_counter()
    step_while(app, lambda: time.perf_counter() - rested < idle_s)
    after = psutil.Process().cpu_times()
    used = (after.user + after.system - before.user - before.system) / idle_s
    yield f"idle for {idle_s:g} s", f"{app.frames_shown - frames} frames, {used:.2%} of a core"


def step_while(app: App, is_wanted: Callable[[], bool]) -> float:
    """Turn the loop while a condition holds; return the longest turn, in seconds of this thread's processor time."""
    longest = 0.0
    while is_wanted():
        began = time.thread_time()
        app.step()
        longest = max(longest, time.thread_time() - began)
    return longest


def is_idle(app: App) -> bool:
    """Return whether every view is on the screen and nothing is left to do."""
    state = app.state
    is_complete = state.progress.is_complete and state.shown_generation == state.generation
    return is_complete and app.wait_s > 0 and app.scene_view.shows_all_views()


def since(began: tuple[float, float]) -> str:
    """Return the time since then in words. began: by the clock and of the processor."""
    return f"{time.perf_counter() - began[0]:.2f} s, {time.process_time() - began[1]:.2f} s of processor time"


def drag(app: App) -> str:
    """Drag to and fro over the picture; return latency and time of pictures in words."""
    pointer = subprocess.Popen(["xdotool", *pointer_moves(app)])
    waiting: dict[ViewOffset, tuple[int, float]] = {}
    frames, latencies, pictures, turn = [], [], [], 0
    while pointer.poll() is None:
        turn += 1
        eye, drawn, began = app.state.optics.eye, app.scene_view.pictures_drawn, time.perf_counter()
        app.step()
        shown = app.scene_view.picture_drawn
        if shown is not None and shown.optics.eye in waiting:
            read_turn, read_at = waiting[shown.optics.eye]
            waiting = {other: read for other, read in waiting.items() if read[0] > read_turn}
            frames.append(turn - read_turn + 1)
            latencies.append(1e3 * (time.perf_counter() - read_at))
        if app.scene_view.pictures_drawn > drawn:
            pictures.append(app.scene_view.report.draw_ms)
        if app.state.optics.eye != eye:
            waiting[app.state.optics.eye] = turn, began
    subprocess.run(["xdotool", "mouseup", "1"], check=True)
    times = (f"{np.median(ms):.0f} ms (90 %: {np.quantile(ms, 0.9):.0f})" for ms in (latencies, pictures))
    return f"latency at most {max(frames)} frames, {', a picture '.join(times)}"


def pointer_moves(app: App) -> Iterator[str]:
    """Yield the words of xdotool for a drag over the middle of the picture."""
    picture = app.layout().picture
    assert picture is not None
    x, y = round(picture.x + picture.width / 2), round(picture.y + picture.height / 2)
    yield from ("mousemove", str(x), str(y), "mousedown", "1")
    for k in range(150):
        right = 2 * (abs((k + 30) % 120 - 60) - 30)
        yield from ("mousemove", str(x + right), str(y + k % 7), "sleep", f"{1 / 60:.4f}")


if __name__ == "__main__":
    main()
