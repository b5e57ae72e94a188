"""Figures of the real window on a private X server: first frame, a new plan, all views, idling.

python -m benchmarks.window, a part of `make bench`.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import psutil

from iibr_core.runtime.resources import resource_folder
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.background import scene_worker
from viewer.background.loaded_photo import LoadedPhoto
from viewer.model.actions import OpenPath
from viewer.model.state.scene import Source

IDLE_S = 5.0


def main() -> None:
    read_at: list[float] = []
    load = scene_worker.load_photo

    def timed_load(*arguments: Any) -> LoadedPhoto:
        loaded = load(*arguments)
        read_at.append(time.perf_counter())
        return loaded

    scene_worker.load_photo = timed_load
    photo = resource_folder("assets") / "motorcycle" / "motorcycle.png"
    with private_display():
        started = time.perf_counter()
        app = App(initial_state(OpenPath(Source(str(photo)))))
        try:
            while app.scene_view.pictures_drawn == 0:
                app.step()
            shown = time.perf_counter()
            print(
                f"first frame: {(shown - read_at[0]) * 1e3:.0f} ms after photo and disparity are read,"
                f" {(shown - started) * 1e3:.0f} ms after the window was asked for;"
                f" torch imported: {'torch' in sys.modules}",
                flush=True,
            )
            all_views(app, shown)
            idle(app)
        finally:
            app.close()


def all_views(app: App, since: float) -> None:
    """Turn the loop until every view is on the screen and nothing is left to do."""
    while not (app.state.progress.is_complete and app.wait_s > 0 and app.scene_view.shows_all_views()):
        app.step()
    frames, total = app.frames_shown, app.state.progress.total
    print(f"all {total} views in the window: {time.perf_counter() - since:.1f} s, {frames} frames shown", flush=True)


def idle(app: App) -> None:
    process, frames = psutil.Process(), app.frames_shown
    before, start = process.cpu_times(), time.perf_counter()
    while time.perf_counter() - start < IDLE_S:
        app.step()
    after, seconds = process.cpu_times(), time.perf_counter() - start
    used = after.user + after.system - before.user - before.system
    print(f"idle for {seconds:.0f} s: {app.frames_shown - frames} frames, {used / seconds:.2%} of a core", flush=True)


if __name__ == "__main__":
    main()
