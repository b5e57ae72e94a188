"""Time the real window on a private X server: first picture, all views, dragging, stereo, a followed head, idling.

    python -m benchmarks window [--idle 5] [--cold]

A frame's time is that of the processor, in the thread that draws. Drags make 60 pointer moves a second; latency is
counted from the turn of the loop that reads a move to the frame that shows its viewpoint, both included. A head jumps
while the window is idle: latency is counted from sending its packet to asking for the picture. Then it moves, by 250
packets a second, and by a flood of 10,000; processor time is that of the whole program. A stereo frame is two pictures
of a moving viewpoint at full quality and their weaving. --cold: as if the driver had compiled no shader before.
"""

from __future__ import annotations

import argparse
import math
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import psutil

from benchmarks.report import markdown
from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.model import lens, stereo, tracking
from viewer.model.action import Action, do
from viewer.model.tracking import GAP_S

SENDER = """
import math, socket, struct, sys, time
port, rate_hz = map(int, sys.argv[1:])
sender, began, sent = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), time.perf_counter(), 0
while True:
    x = 10 * math.sin(math.pi * (time.perf_counter() - began))
    for _ in range(max(rate_hz // 1000, 1)):
        sender.sendto(struct.pack("<6d", x, 0, 60, 0, 0, 0), ("127.0.0.1", port))
        sent += 1
    time.sleep(max(began + sent / rate_hz - time.perf_counter(), 0))
"""
"""Program that sends poses of a head that moves 10 cm to and fro, in two seconds."""
CALM_HZ, FLOOD_HZ = 250, 10_000
JUMPS, ROUNDS, ROUND_S = 21, 5, 2.0
STEREO_SCREEN = ScreenSize(1280, 720)
STEREO_FRAMES = 11
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
        app = TimedApp(initial_state(Source(str(DEMO))))
        try:
            print(markdown(("what", "measured"), rows(app, began, options.idle)))
        finally:
            app.close()


def rows(app: TimedApp, began: tuple[float, float], idle_s: float) -> Iterator[tuple[str, str]]:
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
        yield f"stereo frames, aperture of {aperture} view steps", stereo_frames(app)
        step_while(app, lambda: not is_idle(app))
    app.do(do(lens.set_aperture, 0))
    yield "a head that jumps: from sending the packet to asking for the picture", jump(app)
    yield from move_head(app)
    app.do(do(tracking.switch, None))
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


class TimedApp(App):
    """The viewer, and the time on the clock when it followed a head last."""

    followed_s = 0.0

    def do(self, *actions: Action) -> None:
        """Apply actions to the state."""
        super().do(*actions)
        if any(action.verb is tracking.follow for action in actions):
            self.followed_s = time.perf_counter()


def jump(app: TimedApp) -> str:
    """Let a head jump while the window is idle; return the time from packets to asking for their pictures in words."""
    place, latencies = free_place(), []
    app.do(do(tracking.switch, "udp:{}:{}".format(*place)))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for k in range(JUMPS):
            step_while(app, lambda: not is_idle(app))
            latencies.append(1e3 * follow_jump(app, partial(sender.sendto, struct.pack("<6d", k % 2, *5 * [0]), place)))
    return f"{np.median(latencies):.1f} ms (90 %: {np.quantile(latencies, 0.9):.1f})"


def follow_jump(app: TimedApp, send: Callable[[], int]) -> float:
    """Send a packet once the window sleeps; return the time until it asks for the picture, in seconds."""
    sent_s, before_s = [0.0], app.followed_s

    def send_later() -> None:
        sent_s[0] = time.perf_counter()
        send()

    threading.Timer(2 * GAP_S, send_later).start()
    step_while(app, lambda: app.followed_s == before_s)
    return app.followed_s - sent_s[0]


def move_head(app: TimedApp) -> Iterator[tuple[str, str]]:
    """Let a head move, by few packets and by a flood in turns; yield rows of the table."""
    place = free_place()
    app.do(do(tracking.switch, "udp:{}:{}".format(*place)))
    measured: dict[int, list[tuple[float, float]]] = {CALM_HZ: [], FLOOD_HZ: []}
    for rate_hz in ROUNDS * list(measured):
        sender = subprocess.Popen([sys.executable, "-c", SENDER, str(place[1]), str(rate_hz)])
        measured[rate_hz].append(draw_for(app, ROUND_S))
        sender.kill()
        sender.wait()
    for rate_hz, values in measured.items():
        rate, used_ms = np.median(values, axis=0)
        words = f"{rate:.1f} pictures a second, {used_ms:.1f} ms of processor time for each"
        yield f"a head that moves: {rate_hz} packets a second", words


def draw_for(app: App, seconds: float) -> tuple[float, float]:
    """Turn the loop for some time, after five pictures; return pictures a second and milliseconds of processor time."""
    drawn = app.scene_view.pictures_drawn
    step_while(app, lambda: app.scene_view.pictures_drawn < drawn + 5)
    first, began, used_s = app.scene_view.pictures_drawn, time.perf_counter(), time.process_time()
    step_while(app, lambda: time.perf_counter() - began < seconds)
    pictures, used_s = app.scene_view.pictures_drawn - first, time.process_time() - used_s
    return pictures / (time.perf_counter() - began), 1e3 * used_s / pictures


def free_place() -> tuple[str, int]:
    """Return the loopback address with a free port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return "127.0.0.1", probe.getsockname()[1]


def stereo_frames(app: App) -> str:
    """Draw both eyes' pictures of a moving viewpoint at full quality, and the same pictures alone; return the time."""
    scene, view = app.state.scene, app.stereo_screen.view
    assert scene is not None
    alone_s, woven_s = [], []
    app.do(do(stereo.set_eyes, 1.0))
    for s in np.linspace(-1, 1, STEREO_FRAMES):
        app.do(do(lens.move_eye, ViewOffset(0.3, float(s))))
        weave = stereo.weave_of(app.state, scene, STEREO_SCREEN)
        began = time.process_time()
        for eye in weave.eyes:
            app.scene_view.renderer.render_in_time(eye.optics, eye.size_px, math.inf, eye.part)
        alone_s.append(time.process_time() - began)
        began = time.process_time()
        view.draw(weave, math.inf)
        woven_s.append(time.process_time() - began)
    view.release()
    alone, woven = (1e3 * float(np.median(times)) for times in (alone_s, woven_s))
    return f"{woven:.0f} ms of processor time, {woven / alone:.2f} times two frames of one eye"


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
