"""The real window used for long, on a private X server: seeded random actions, one after the other.

python -m benchmarks.use [--steps 1000] [--seed 0]

Says what memory the process fills after so many actions and once it rests, against a fresh window that rests with the
same photo and grid: photos differ in size, and grids in views. Then how threads and open files stand, and how long
frames took but while something was opened, of wall time and of processor time of the window's own thread: other
programs make frames wait, and only the second tells what this one costs.
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil

from iibr_core.exports.options import ExportOptions
from iibr_core.formats.images.photo import write_image
from iibr_core.rendering.gloss.settings import Gloss
from iibr_core.runtime.allocator import limit_arenas
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.model.actions import Action, DismissNotices, DoTask, EndGesture, OpenPath, Redo, ShowPrompt, Undo
from viewer.model.free_camera import LeaveCamera, MoveCamera
from viewer.model.state.depth_editing import Paint
from viewer.model.state.exporting import ExportTask
from viewer.model.state.folder import ShowFilmstrip, StepPhoto
from viewer.model.state.inspection import OVERLAYS, Compare, KeepState, SetOverlay, ShowEpis, ShowGrid
from viewer.model.state.optics import FocusOn, MoveEye, ResetOptics, SetAperture, SetGloss
from viewer.model.state.tasks import SaveTask
from viewer.model.zoom import SetZoom, Zoom

SIZES = (600, 900), (700, 600), (480, 720), (640, 960), (512, 512), (560, 840)
"""Of the photos in the folder: (height, width)."""
GRIDS = 5, 7, 9
FRAMES_A_STEP = 3
SLOW_FRAME_S = 0.25
RESTS_AFTER, REST_S = 10, 600.0
COUNTED_AFTER = 10, 100, 250, 500, 1000, 2000
MIB = 2**20


def make_photos(folder: Path) -> None:
    """Photos with a near shape before a wall, and their maps beside them."""
    for i, (height, width) in enumerate(SIZES):
        rng = np.random.default_rng(i)
        coarse = rng.integers(40, 220, (-(-height // 6), -(-width // 6), 3))
        disparity = np.full((height, width), -1.0, np.float32)
        disparity[height // 4 : 3 * height // 4, width // 3 : 2 * width // 3] = 2.0
        write_image(folder / f"photo{i}.png", coarse.repeat(6, 0).repeat(6, 1)[:height, :width].astype(np.uint8))
        np.save(folder / f"photo{i}_disparity.npy", disparity)


class User:
    """Does one thing a step. frames: seconds (wall, processor) of those while nothing was opened."""

    def __init__(self, app: App, out: Path, seed: int = 0) -> None:
        self.app, self.out = app, out
        self.frames: list[tuple[float, float, str]] = []
        self._random = random.Random(seed)
        self._doing = ""

    def step(self) -> None:
        """Do something."""
        often = self.drag, self.focus, self.brush, self.undo
        seldom = (
            self.zoom, self.overlay, self.inspect, self.compare, self.gloss, self.turn_camera, self.save, self.export,
            self.switch, self.change_grid,
        )  # fmt: skip
        thing: Callable[[], None] = self._random.choice((*often, *often, *seldom))
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
        """A stroke."""
        x, y = (self._random.uniform(0.1, 0.8) for _ in "xy")
        for k in range(FRAMES_A_STEP):
            self.do(Paint((x + 0.03 * k, y)))
        self.do(EndGesture())

    def undo(self) -> None:
        """Take some edits back, or do the last again."""
        self.do(*self._random.choice(([Undo()], 3 * [Undo()], [Redo()])), EndGesture())

    def zoom(self) -> None:
        """Look closer, or at the whole."""
        at = self._random.uniform(0.2, 0.8), self._random.uniform(0.2, 0.8)
        self.do(SetZoom(self._random.choice((None, Zoom(self._random.uniform(1, 3), at)))))

    def overlay(self) -> None:
        """Lay something over the picture, or take it away."""
        self.do(SetOverlay(self._random.choice((None, *OVERLAYS))))

    def inspect(self) -> None:
        """Show or hide EPIs and the sheet of views."""
        state = self.app.state.inspection
        self.do(self._random.choice((ShowEpis(not state.shows_epis), ShowGrid(not state.shows_grid))))

    def compare(self) -> None:
        """With the photo, the best quality, a state that was kept; or no longer."""
        self.do(KeepState(), Compare(self._random.choice((None, "photo", "quality", "kept", "difference"))))

    def gloss(self) -> None:
        """Make what is near glossy, or nothing."""
        self.do(SetGloss(self._random.choice((None, Gloss(roughness=self._random.uniform(0.1, 0.6))))))

    def turn_camera(self) -> None:
        """Leave the plane of views, and come back some frames later."""
        self.do(MoveCamera(right=self._random.uniform(-0.3, 0.3), forward=self._random.uniform(0, 0.3)))
        self.do(LeaveCamera())

    def save(self) -> None:
        """Save a picture and wait for it."""
        self.do(DoTask(SaveTask(str(self.out / "picture.png"), ScreenSize(270, 180), may_replace=True)))
        self.until(lambda: not self.app.state.jobs and not self.app.state.tasks)
        self.do(DismissNotices())

    def export(self) -> None:
        """Export something small; what is asked for too early is refused."""
        kind, ending, options = self._random.choice(
            (
                ("gif", ".gif", ExportOptions(size=ScreenSize(120, 80), frames=6)),
                ("rgbd", ".png", ExportOptions()),
                ("anaglyph", ".png", ExportOptions(size=ScreenSize(240, 160))),
            )
        )
        self.do(DoTask(ExportTask(kind, str(self.out / f"{kind}{ending}"), options, may_replace=True)))
        self.do(ShowPrompt(None))

    def switch(self) -> None:
        """Another photo of the folder."""
        source = self.app.state.source
        name = Path(source.path).stem if source else "photo0"
        last = name == f"photo{len(SIZES) - 1}"
        self.do(ResetOptics(), StepPhoto(1 - len(SIZES) if last else 1))
        self.until(self.is_open)

    def go_back(self) -> None:
        """The first photo as it was opened, nothing else looked at."""
        source = self.app.state.source
        assert source is not None
        first = replace(source, path=str(Path(source.path).with_name("photo0.png")), grid=None)
        self.do(SetOverlay(None), Compare(None), ShowEpis(False), ShowGrid(False), SetZoom(None))
        self.do(ResetOptics(), SetGloss(None), OpenPath(first))
        self.until(self.is_open)

    def change_grid(self) -> None:
        """More views, or fewer."""
        source = self.app.state.source
        if source is not None:
            side = self._random.choice(GRIDS)
            self.do(OpenPath(replace(source, grid=GridShape(side, side))))
            self.until(self.is_open)

    def is_open(self) -> bool:
        """Whether what was asked for is open."""
        state = self.app.state
        return state.scene is not None and state.scene.source is state.source

    def is_resting(self) -> bool:
        """Whether nothing is going on any more."""
        state = self.app.state
        is_busy = bool(state.jobs or state.tasks)
        return self.is_open() and state.progress.is_complete and self.app.wait_s > 0 and not is_busy

    def do(self, *actions: Action) -> None:
        """Ask for this, and show a frame."""
        self.app.do(*actions)
        self.frame()

    def until(self, condition: Callable[[], bool], most_s: float = 60.0) -> None:
        """Show frames until it is so, for so long at most."""
        end = time.perf_counter() + most_s
        while not condition() and time.perf_counter() < end:
            self.frame()

    def frame(self) -> None:
        """A turn of the loop, as long as it takes without the sleep it begins with."""
        waits = self.app.wait_s > 0
        start, used, was_open = time.perf_counter(), time.thread_time(), self.is_open()
        self.app.step()
        if was_open and self.is_open() and not waits and self._doing not in ("switch", "change_grid"):
            self.frames.append((time.perf_counter() - start, time.thread_time() - used, self._doing))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fresh", nargs=3, metavar=("PHOTO", "ROWS", "COLUMNS"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    limit_arenas()  # as the program does
    if arguments.fresh:
        path, *views = arguments.fresh
        print(memory_of_fresh_window(path, GridShape(*map(int, views))))
        return
    with tempfile.TemporaryDirectory() as name, private_display():
        folder, out = Path(name) / "photos", Path(name)
        folder.mkdir()
        make_photos(folder)
        threads_before = threading.active_count()
        app = App(initial_state(OpenPath(Source(str(folder)))))
        user = User(app, out, arguments.seed)
        try:
            user.until(lambda: user.is_open() and app.state.folder is not None)
            user.do(ShowFilmstrip(True))
            user.frames.clear()
            take_steps(user, arguments.steps)
        finally:
            app.close()
        left = threading.active_count() - threads_before
    print_frames(user.frames)
    print(f"threads of Python left when the window is closed: {left}")


def memory_of_fresh_window(path: str, grid: GridShape) -> float:
    """MiB of this process once its window rests with a photo and all its views."""
    with private_display() as _, tempfile.TemporaryDirectory() as out:
        app = App(initial_state(OpenPath(Source(path, grid=grid))))
        user = User(app, Path(out))
        try:
            user.until(lambda: user.is_open() and app.state.folder is not None)
            user.do(ShowFilmstrip(True))
            user.until(user.is_resting, REST_S)
            return float(psutil.Process().memory_info().rss) / MIB
        finally:
            app.close()


def fresh_memory(user: User) -> float:
    """The same in another process, with what this window shows."""
    scene = user.app.state.scene
    assert scene is not None
    command = [sys.executable, "-m", "benchmarks.use", "--fresh", scene.source.path, *map(str, scene.grid)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def take_steps(user: User, steps: int) -> None:
    """Say what the process takes after some of them, and at the end."""
    process = psutil.Process()
    print("| after | memory, MiB | fresh, MiB | times | open files | threads |\n| --- | --- | --- | --- | --- | --- |")

    def tell(when: str) -> None:
        rss, fresh = process.memory_info().rss / MIB, fresh_memory(user)
        cells = when, f"{rss:.0f}", f"{fresh:.0f}", f"{rss / fresh:.2f}", process.num_fds(), process.num_threads()
        print(f"| {' | '.join(map(str, cells))} |", flush=True)

    for number in range(1, steps + 1):
        user.step()
        if number in COUNTED_AFTER or number == steps:
            tell(f"{number} actions")
        if number in (RESTS_AFTER, steps):
            user.until(user.is_resting, REST_S)
            tell(f"{number} actions, at rest")
            user.go_back()
            user.until(user.is_resting, REST_S)
            tell(f"{number} actions, back at the first photo")


def print_frames(frames: list[tuple[float, float, str]]) -> None:
    """How long they took, and what the longest one did."""
    for what, index in (("wall time", 0), ("processor time", 1)):
        took = sorted(frame[index] for frame in frames)
        slow = sum(seconds > SLOW_FRAME_S for seconds in took)
        median, longest = took[len(took) // 2] * 1e3, took[-1] * 1e3
        print(f"frames, {what}: median {median:.0f} ms, longest {longest:.0f} ms, {slow} over 250")
    print(f"the longest by processor time was while it did: {max(frames, key=lambda frame: frame[1])[2]}")


if __name__ == "__main__":
    main()
