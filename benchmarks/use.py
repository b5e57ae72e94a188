"""The real window used for long, on a private X server: seeded random actions, one after the other.

python -m benchmarks.use [--steps 1000] [--seed 0]

Prints the memory of the process after so many actions and once it rests, against a fresh window that rests with the
same photo and grid: photos differ in size, and grids in views; how threads and open files stand; and of which action
the longest frame was, in processor time of the thread that draws.
"""

from __future__ import annotations

import random
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import psutil

from benchmarks.harness.bench_scenes import write_photo
from benchmarks.harness.real_window import open_window
from benchmarks.harness.reports import emit, head, parser_of, row, start
from benchmarks.harness.timing import in_own_process
from benchmarks.harness.turn_times import Turn, Turns, watched_turns
from iibr_core.exports.kinds import ExportOptions
from iibr_core.gloss.settings import Gloss
from iibr_core.runtime.machine import limit_arenas
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from viewer.app.main_loop import App
from viewer.model.actions import Action, DismissNotice, DoTask, EndGesture, OpenPath, Redo, ShowPrompt, Undo
from viewer.model.free_camera import LeaveCamera, MoveCamera
from viewer.model.state.depth_editing import Paint
from viewer.model.state.exporting import ExportTask
from viewer.model.state.folder import StepPhoto
from viewer.model.state.inspection import OVERLAYS, Compare, KeepState, SetInspection, SetOverlay
from viewer.model.state.optics_actions import FocusOn, MoveEye, ResetOptics, SetAperture, SetOptics
from viewer.model.state.preferences import SetPreference
from viewer.model.state.tasks import SaveTask
from viewer.model.zoom import SetZoom, Zoom

SIZES = (600, 900), (700, 600), (480, 720), (640, 960), (512, 512), (560, 840)
"""Sizes (height, width) of the photos in the folder."""
GRIDS = 5, 7, 9
FRAMES_A_STEP = 3
RESTS_AFTER, OPEN_S = 10, 60.0
COUNTED_AFTER = 10, 100, 250, 500, 1000, 2000
MIB = 2**20
EXPORTS = (
    ("gif", ".gif", ExportOptions(size=ScreenSize(120, 80), frames=6)),
    ("rgbd", ".png", ExportOptions()),
    ("anaglyph", ".png", ExportOptions(size=ScreenSize(240, 160))),
)


class User:
    """Does things in a window. out: folder to save to."""

    def __init__(self, app: App, out: Path, seed: int = 0) -> None:
        self.app, self.out, self.random = app, out, random.Random(seed)

    def step(self) -> str:
        """Do a random thing, frequent ones more often, and return its name."""
        thing = self.random.choice(2 * OFTEN + SELDOM)
        if thing in ASKED:
            self.do(*ASKED[thing](self))
        else:
            DONE[thing](self)
        return thing

    def between(self, low: float, high: float) -> float:
        """A random number."""
        return self.random.uniform(low, high)

    def do(self, *actions: Action) -> None:
        """Ask for this, and show a frame."""
        self.app.do(*actions)
        self.frame()

    def until(self, condition: Callable[[], bool], most_s: float = OPEN_S) -> None:
        """Show frames until it is so, for so long at most."""
        end = time.perf_counter() + most_s
        while not condition() and time.perf_counter() < end:
            self.frame()

    def open(self, *actions: Action) -> None:
        """Ask for another scene and wait for it."""
        self.do(*actions)
        self.until(self.is_open)

    def is_open(self) -> bool:
        """Whether what was asked for is open."""
        state = self.app.state
        return state.scene is not None and state.scene.source is state.source

    def rest(self) -> None:
        """Show frames until nothing is going on any more."""
        app, is_open = self.app, self.is_open
        while not (is_open() and app.state.progress.is_complete and app.wait_s > 0 and not app.state.jobs):
            self.frame()

    def frame(self) -> None:
        """A turn of the loop."""
        self.app.step()


def drag(user: User) -> None:
    for _ in range(FRAMES_A_STEP):
        user.do(MoveEye(ViewOffset(user.between(-2, 2), user.between(-2, 2))))


def brush(user: User) -> None:
    x, y = user.between(0.1, 0.8), user.between(0.1, 0.8)
    for k in range(FRAMES_A_STEP):
        user.do(Paint((x + 0.03 * k, y)))
    user.do(EndGesture())


def turn_camera(user: User) -> None:
    user.do(MoveCamera(right=user.between(-0.3, 0.3), forward=user.between(0, 0.3)))
    user.do(LeaveCamera())


def save(user: User) -> None:
    user.do(DoTask(SaveTask(str(user.out / "picture.png"), ScreenSize(270, 180), may_replace=True)))
    user.until(lambda: not user.app.state.jobs and not user.app.state.tasks)
    user.do(DismissNotice(None))


def export(user: User) -> None:
    """Export the scene; the window refuses it before all views are there."""
    kind, ending, options = user.random.choice(EXPORTS)
    user.do(DoTask(ExportTask(kind, str(user.out / f"{kind}{ending}"), options, may_replace=True)))
    user.do(ShowPrompt(None))


def switch(user: User) -> None:
    source = user.app.state.source
    is_last = source is not None and Path(source.path).stem == f"photo{len(SIZES) - 1}"
    user.open(ResetOptics(), StepPhoto(1 - len(SIZES) if is_last else 1))


def change_grid(user: User) -> None:
    source, side = user.app.state.source, user.random.choice(GRIDS)
    if source is not None:
        user.open(OpenPath(replace(source, grid=GridShape(side, side))))


ASKED: dict[str, Callable[[User], Sequence[Action]]] = {
    "focus": lambda u: (FocusOn((0.0, 0.0), u.between(-2, 2)), SetAperture(u.between(0, 4)), EndGesture()),
    "undo": lambda u: (*u.random.choice(([Undo()], 3 * [Undo()], [Redo()])), EndGesture()),
    "zoom": lambda u: [
        SetZoom(u.random.choice((None, Zoom(u.between(1, 3), (u.between(0.2, 0.8), u.between(0.2, 0.8))))))
    ],
    "overlay": lambda u: [SetOverlay(u.random.choice((None, *OVERLAYS)))],
    "epis": lambda u: [SetInspection("shows_epis", not u.app.state.inspection.shows_epis)],
    "all views": lambda u: [SetInspection("shows_grid", not u.app.state.inspection.shows_grid)],
    "compare": lambda u: (KeepState(), Compare(u.random.choice((None, "photo", "kept", "difference")))),
    "gloss": lambda u: [SetOptics("gloss", u.random.choice((None, Gloss(roughness=u.between(0.1, 0.6)))))],
}
"""Actions of one frame."""
DONE = {f.__name__: f for f in (drag, brush, turn_camera, save, export, switch, change_grid)}
OFTEN = ("drag", "focus", "brush", "undo")
SELDOM = tuple(sorted({*ASKED, *DONE} - {*OFTEN}))


def go_back(user: User) -> None:
    """The first photo as it was opened, nothing else looked at."""
    source = user.app.state.source
    assert source is not None
    first = replace(source, path=str(Path(source.path).with_name("photo0.png")), grid=None)
    user.do(
        SetOverlay(None),
        Compare(None),
        SetInspection("shows_epis", False),
        SetInspection("shows_grid", False),
        SetZoom(None),
    )
    user.open(ResetOptics(), SetOptics("gloss", None), OpenPath(first))


def main() -> None:
    parser = parser_of(__doc__, "seed")
    parser.add_argument("--steps", type=int, default=1000)
    options = parser.parse_args()
    limit_arenas()  # as the program does
    emit(report(options.steps, options.seed))


def report(steps: int, seed: int) -> Iterator[str]:
    threads_before = threading.active_count()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "photos"
        folder.mkdir()
        for i, size in enumerate(SIZES):
            write_photo(folder / f"photo{i}.png", size, i)
        with open_window(Source(str(folder))) as app:
            user = User(app, Path(name), seed)
            open_first(user)
            with watched_turns(app) as turns:
                yield from take_steps(user, steps, turns)
    yield f"\nThreads of Python left when the window is closed: {threading.active_count() - threads_before}."


def open_first(user: User) -> None:
    user.until(lambda: user.is_open() and user.app.state.folder is not None)
    user.do(SetPreference("shows_filmstrip", True))


def memory_of_fresh_window(path: str, grid: GridShape) -> float:
    """MiB of this process once its window rests with a photo and all its views."""
    limit_arenas()
    with open_window(Source(path, grid=grid)) as app:
        user = User(app, Path())
        open_first(user)
        user.rest()
        return float(psutil.Process().memory_info().rss) / MIB


def take_steps(user: User, steps: int, turns: Turns) -> Iterator[str]:
    """Yield the memory of the process after some of the actions, and at the end; then the longest frame of each."""
    process = psutil.Process()
    longest: dict[str, Turn] = {}

    def line(when: str) -> str:
        scene = user.app.state.scene
        assert scene is not None
        rss = process.memory_info().rss / MIB
        fresh = in_own_process(memory_of_fresh_window, scene.source.path, scene.grid)
        return row(when, f"{rss:.0f}", f"{fresh:.0f}", f"{rss / fresh:.2f}", process.num_fds(), process.num_threads())

    yield head("after", "memory, MiB", "fresh, MiB", "times", "open files", "threads")
    for number in range(1, steps + 1):
        turns.longest = Turn()
        thing = user.step()
        longest[thing] = max(longest.get(thing, Turn()), turns.longest)
        if number in COUNTED_AFTER or number == steps:
            yield line(f"{number} actions")
        if number in (RESTS_AFTER, steps):
            user.rest()
            yield line(f"{number} actions, at rest")
            go_back(user)
            user.rest()
            yield line(f"{number} actions, back at the first photo")
    yield "\n" + head("action", "longest frame")
    for thing, turn in sorted(longest.items(), key=lambda item: item[1], reverse=True):
        yield row(thing, turn)


if __name__ == "__main__":
    start("benchmarks.use", main)
