"""Going through a folder of photos in the real window, on a private X server: how soon each is there, and memory.

python -m benchmarks.folder [--folder FOLDER] [--photos 200] [--megapixels 12] [--dwell 1]

Without a folder the photos are made up: texture and noise, as JPEG. Counted from asking for the next photo to the
frame that shows it, in seconds and in processor time of all threads; dwell: so long each is looked at. Memory:
resident, after every step.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
from PIL import Image

from iibr_core.runtime.allocator import limit_arenas
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.model.actions import OpenPath
from viewer.model.state.folder import ShowFilmstrip, StepPhoto
from viewer.model.state.scene import Source

DIFFERENT = 8
"""Photos that are encoded; the others are links to them."""

WARM_UP = 10
"""Steps before memory is looked at."""


def make_photos(folder: Path, count: int, megapixels: float) -> None:
    """Photos of 4 by 3 with large shapes, fine texture and noise."""
    height = round((megapixels * 1e6 * 3 / 4) ** 0.5)
    size = (round(height * 4 / 3), height)
    for i in range(count):
        path = folder / f"IMG_{i:04d}.JPG"
        if i >= DIFFERENT:
            path.hardlink_to(folder / f"IMG_{i % DIFFERENT:04d}.JPG")
            continue
        rng = np.random.default_rng(i)
        image = Image.fromarray(rng.integers(0, 255, (75, 100, 3), dtype=np.uint8)).resize(
            size, Image.Resampling.BICUBIC
        )
        pixels = np.asarray(image).astype(np.int16) + rng.integers(-8, 8, (size[1], size[0], 1), dtype=np.int16)
        Image.fromarray(pixels.clip(0, 255).astype(np.uint8)).save(path, quality=90)


def step(app: App, dwell_s: float) -> tuple[float, float]:
    """Seconds and processor time until the next photo is on the screen; then it is looked at for a while."""
    start, used = time.perf_counter(), time.process_time()
    app.do(StepPhoto(1))
    wanted = app.state.generation
    shown = app.frames_shown
    while not _shows(app, wanted, shown):
        shown = app.frames_shown
        app.step()
    took = time.perf_counter() - start, time.process_time() - used
    while time.perf_counter() - start < dwell_s:
        app.step()
    return took


def _shows(app: App, generation: int, before: int) -> bool:
    """Whether a frame since those before had this photo."""
    drawn = app.scene_view.picture_drawn
    return app.frames_shown > before and drawn is not None and drawn.generation == generation


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--photos", type=int, default=200)
    parser.add_argument("--megapixels", type=float, default=12.0)
    parser.add_argument("--dwell", type=float, default=1.0)
    options = parser.parse_args()
    limit_arenas()  # as the program does
    with tempfile.TemporaryDirectory() as name, private_display():
        if options.folder is None:
            make_photos(Path(name), options.photos, options.megapixels)
        app = App(initial_state(OpenPath(Source(str(options.folder or name)))))
        try:
            while app.state.folder is None or app.scene_view.pictures_drawn == 0:
                app.step()
            app.do(ShowFilmstrip(True))
            process, took, memory = psutil.Process(), [], []
            for _ in range(options.photos - 1):
                took.append(step(app, options.dwell))
                memory.append(process.memory_info().rss / 2**20)
        finally:
            app.close()
    seconds, processor = (sorted(values) for values in zip(*took))
    tail = memory[min(WARM_UP, len(memory) - 1) :]
    print(f"{len(took)} steps from photo to photo, each looked at for {options.dwell:g} s")
    print(
        f"first picture: median {statistics.median(seconds):.2f} s ({statistics.median(processor):.2f} s of processor"
        f" time), 95 of 100 within {seconds[int(0.95 * (len(seconds) - 1))]:.2f} s, the slowest {seconds[-1]:.2f} s"
    )
    half = len(tail) // 2 or 1
    early, late = statistics.median(tail[:half]), statistics.median(tail[half:] or tail)
    print(
        f"memory: median {early:.0f} MiB in the first half, {late:.0f} MiB in the second, {max(tail):.0f} MiB at most"
    )
    if hasattr(os, "getloadavg"):
        print(f"load of the machine at the end, this program included: {os.getloadavg()[1]:.1f}")


if __name__ == "__main__":
    main()
