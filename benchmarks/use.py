"""The real window used for long, on a private X server: open, drag, focus, brush, save, switch, over and over.

python -m benchmarks.use [--steps 2000]

Says how memory, threads and open files stand after the first 50 steps and at the end, and how long frames took but
while something was opened, of wall time and of processor time of the window's own thread: other programs make frames
wait, and only the second tells what this one costs.
"""

from __future__ import annotations

import argparse
import random
import statistics
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import psutil

from iibr_core.formats.images.photo import write_image
from iibr_core.runtime.allocator import limit_arenas
from iibr_core.types import GridShape, ViewOffset
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.model.actions import Action, DismissNotices, DoTask, EndGesture, OpenPath, Undo
from viewer.model.layout import ScreenSize
from viewer.model.state.depth_editing import Paint
from viewer.model.state.folder import ShowFilmstrip, StepPhoto
from viewer.model.state.optics import FocusOn, MoveEye, ResetOptics, SetAperture
from viewer.model.state.scene import Source
from viewer.model.state.tasks import SaveTask

PHOTOS, SIZE = 6, (360, 540)
GRID = GridShape(5, 5)
WARM_UP = 50
FRAMES_A_STEP = 3
SLOW_FRAME_S = 0.25


def make_photos(folder: Path) -> None:
    """Photos with a near shape before a wall, and their maps beside them."""
    height, width = SIZE
    for i in range(PHOTOS):
        rng = np.random.default_rng(i)
        pixels = rng.integers(40, 220, (height // 6, width // 6, 3)).repeat(6, 0).repeat(6, 1).astype(np.uint8)
        disparity = np.full(SIZE, -1.0, np.float32)
        disparity[height // 4 : 3 * height // 4, width // 3 : 2 * width // 3] = 2.0
        write_image(folder / f"photo{i}.png", pixels)
        np.save(folder / f"photo{i}_disparity.npy", disparity)


class User:
    """Does one thing a step, as a person would. frames: seconds (wall, processor) of those while nothing was opened."""

    def __init__(self, app: App, out: Path) -> None:
        self.app, self.out = app, out
        self.frames: list[tuple[float, float, str]] = []
        self._random = random.Random(0)
        self._doing = ""

    def step(self, number: int) -> None:
        """Do the thing whose turn it is."""
        things: tuple[Callable[[], None], ...] = (self.drag, self.focus, self.drag, self.brush, self.save, self.switch)
        thing = things[number % len(things)]
        self._doing = thing.__name__
        thing()

    def drag(self) -> None:
        """Move the viewpoint, frame by frame."""
        for _ in range(FRAMES_A_STEP):
            self.do(MoveEye(ViewOffset(self._random.uniform(-2, 2), self._random.uniform(-2, 2))))

    def focus(self) -> None:
        """Click somewhere with some aperture."""
        self.do(FocusOn((0.0, 0.0), self._random.uniform(-2, 2)), SetAperture(self._random.uniform(0, 4)), EndGesture())

    def brush(self) -> None:
        """A stroke, seen, waited for, and taken back."""
        for k in range(FRAMES_A_STEP):
            self.do(Paint((0.4 + 0.02 * k, 0.5)))
        self.do(EndGesture())
        self.until(lambda: self.app.state.progress.total > 0)
        self.do(Undo(), EndGesture())

    def save(self) -> None:
        """Save a picture and wait for it."""
        self.do(DoTask(SaveTask(str(self.out / "picture.png"), ScreenSize(270, 180), may_replace=True)))
        self.until(lambda: self.app.state.saving is None and not self.app.state.tasks)
        self.do(DismissNotices())

    def switch(self) -> None:
        """The next photo; after the last one the first."""
        place = self.app.state.source.path if self.app.state.source else ""
        self.do(ResetOptics(), StepPhoto(1 if not place.endswith(f"photo{PHOTOS - 1}.png") else 1 - PHOTOS))
        self.until(self.is_open)

    def is_open(self) -> bool:
        """Whether what was asked for is open."""
        state = self.app.state
        return state.scene is not None and state.scene.source is state.source

    def do(self, *actions: Action) -> None:
        """Ask for this, and show a frame."""
        self.app.do(*actions)
        self.frame()

    def until(self, condition: Callable[[], bool]) -> None:
        """Show frames until it is so, for a minute at most."""
        end = time.perf_counter() + 60
        while not condition() and time.perf_counter() < end:
            self.frame()

    def frame(self) -> None:
        """A turn of the loop, as long as it takes without the sleep it begins with."""
        waits = self.app.wait_s > 0
        start, used, was_open = time.perf_counter(), time.thread_time(), self.is_open()
        self.app.step()
        if was_open and self.is_open() and not waits and self._doing != "switch":
            self.frames.append((time.perf_counter() - start, time.thread_time() - used, self._doing))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=2000)
    steps = parser.parse_args().steps
    limit_arenas()  # as the program does
    with tempfile.TemporaryDirectory() as name, private_display():
        folder, out = Path(name) / "photos", Path(name)
        folder.mkdir()
        make_photos(folder)
        threads_before = threading.active_count()
        app = App(initial_state(OpenPath(Source(str(folder), grid=GRID))))
        user, process, memory, handles, threads = User(app, out), psutil.Process(), [], [], []
        try:
            user.until(lambda: user.is_open() and app.state.folder is not None)
            user.do(ShowFilmstrip(True))
            user.frames.clear()
            for number in range(steps):
                user.step(number)
                memory.append(process.memory_info().rss / 2**20)
                handles.append(process.num_fds())
                threads.append(process.num_threads())
        finally:
            app.close()
        left = threading.active_count() - threads_before
    print(f"{steps} steps: {len(user.frames)} frames while nothing was opened")
    for what, index in (("wall time", 0), ("processor time", 1)):
        took = sorted(frame[index] for frame in user.frames)
        slow = sum(seconds > SLOW_FRAME_S for seconds in took)
        median, longest = took[len(took) // 2] * 1e3, took[-1] * 1e3
        print(f"frames, {what}: median {median:.0f} ms, longest {longest:.0f} ms, {slow} over 250")
    slowest = max(user.frames, key=lambda frame: frame[1])
    print(f"the longest by processor time was while it did: {slowest[2]}")
    early, late = memory[WARM_UP : WARM_UP + 50], memory[-50:]
    if early:
        before, after = statistics.median(early), statistics.median(late)
        print(f"memory: {before:.0f} MiB after {WARM_UP} steps, {after:.0f} at the end")
        print(f"open files: {handles[WARM_UP]} and {handles[-1]}; threads: {threads[WARM_UP]} and {threads[-1]}")
    print(f"threads of Python left when the window is closed: {left}")


if __name__ == "__main__":
    main()
