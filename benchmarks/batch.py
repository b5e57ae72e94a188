"""What handing photos to workers costs: `iibr batch`'s rate against that of one process without Dask times the workers.

    python -m benchmarks.batch --photos 200 --megapixels 1 --workers 2 --kind depth

Photos are textured squares before a texture, all different, with maps beside them. Starting and warming up count apart.
On a machine that is shared only processor time says much; by the clock, workers share caches and memory too.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.images.photo import write_image
from iibr_core.formats.maps.writer import write_map
from iibr_core.runtime import tiling
from viewer.app.batch.archive import photos_in
from viewer.app.batch.cluster import local_workers, outcomes_of, warm_workers
from viewer.app.batch.task import BatchSettings, PhotoTask, key_of, target_name
from viewer.app.batch.work import export_photo, warm_up
from viewer.model.state.scene import Source


def write_photos(folder: Path, count: int, megapixels: float) -> None:
    height = round(math.sqrt(megapixels * 1e6 * 3 / 4))
    size = height, height * 4 // 3
    rows, columns = np.indices(size)
    for number in range(count):
        generator = np.random.default_rng(number)
        texture = generator.integers(0, 80, (-(-size[0] // 8), -(-size[1] // 8), 3))
        colors = texture.repeat(8, 0).repeat(8, 1)[: size[0], : size[1]]
        place = generator.random(2) * size / 2
        is_near = (abs(rows - place[0]) < size[0] / 4) & (abs(columns - place[1]) < size[1] / 4)
        write_image(folder / f"{number:05}.png", (colors + np.where(is_near, 150, 30)[..., None]).astype(np.uint8))
        write_map(folder / f"{number:05}_disparity.pfm", np.where(is_near, 2.0, 0.5).astype(np.float32))


def tasks_for(photos: Path, out: Path, settings: BatchSettings) -> list[PhotoTask]:
    found = photos_in([photos])
    return [
        PhotoTask(photo.path, str(out / target_name(settings, photo)), key_of(settings, photo), settings)
        for photo in found
    ]


def one_process(tasks: list[PhotoTask], settings: BatchSettings) -> tuple[float, float]:
    """Seconds a photo, of wall and processor."""
    tiling.THREADS = 1  # as a worker has it
    warm_up(settings)
    wall, processor = time.perf_counter(), time.process_time()
    for task in tasks:
        outcome = export_photo(task)
        assert not outcome.reason, outcome.reason
    return (time.perf_counter() - wall) / len(tasks), (time.process_time() - processor) / len(tasks)


def processor_seconds() -> float:
    """Of this process and its workers."""
    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def with_workers(tasks: list[PhotoTask], settings: BatchSettings, workers: int) -> tuple[float, float, float]:
    """Seconds a photo, of wall and processor, and seconds to start."""
    begun = time.perf_counter()
    with local_workers(workers, 1) as client:
        warm_workers(client, settings, None)
        started = time.perf_counter() - begun
        wall, processor = time.perf_counter(), processor_seconds()
        for _, outcome in outcomes_of(client, tasks):
            assert not outcome.reason, outcome.reason
        wall, processor = time.perf_counter() - wall, processor_seconds() - processor
    return wall / len(tasks), processor / len(tasks), started


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photos", type=int, default=200)
    parser.add_argument("--megapixels", type=float, default=1.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kind", default="depth")
    given = parser.parse_args()
    settings = BatchSettings(given.kind, Source("", DepthChoice()))
    with tempfile.TemporaryDirectory() as scratch:
        photos = Path(scratch, "photos")
        photos.mkdir()
        write_photos(photos, given.photos, given.megapixels)
        tasks = tasks_for(photos, Path(scratch, "one"), settings)
        wall, processor = one_process(tasks, settings)
        print(f"one process:  {wall:.3f} s a photo, {processor:.3f} s of processors")
        moved = [replace(task, target=task.target.replace("/one/", "/many/")) for task in tasks]
        many_wall, many_processor, started = with_workers(moved, settings, given.workers)
        print(f"{given.workers} workers:    {many_wall:.3f} s a photo, {many_processor:.3f} s of processors, after"
              f" {started:.1f} s of starting")  # fmt: skip
        print(f"rate against one process times {given.workers}: {wall / many_wall / given.workers:.1%} by the clock,"
              f" {processor / many_processor:.1%} by processor time")  # fmt: skip


if __name__ == "__main__":
    main()
