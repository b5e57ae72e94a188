"""What an archive costs the process that hands it out: time and memory to find its photos, and to go through all of
them in a second run, when everything is there. No photo is exported.

    python -m benchmarks.batch_planning --photos 100000
"""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from iibr_core.formats.images.photo import write_image
from iibr_core.types import ignore_progress
from viewer.app.batch.archive import ArchivePhoto, photos_in
from viewer.app.batch.ledger import MANIFEST, Ledger
from viewer.app.batch.run import run_batch, workers_here
from viewer.app.batch.task import BatchSettings, key_of, target_name
from viewer.model.state.scene import Source

FOLDER_SIZE = 1000
SETTINGS = BatchSettings("depth", Source(""))


def write_archive(folder: Path, count: int) -> None:
    """Small photos, all different by their last bytes, a thousand in a folder."""
    write_image(folder / "one.png", np.zeros((16, 16, 3), np.uint8))
    pixels = (folder / "one.png").read_bytes()
    (folder / "one.png").unlink()
    for number in range(count):
        place = folder / f"{number // FOLDER_SIZE:04}"
        place.mkdir(exist_ok=True)
        (place / f"{number:06}.png").write_bytes(pixels + number.to_bytes(4, "big"))


def pretend_finished(out: Path, photos: list[ArchivePhoto]) -> None:
    """As a first run leaves it, but for what it exported."""
    out.mkdir()
    with (out / MANIFEST).open("w", encoding="utf-8") as manifest:  # `Ledger` would settle every line on disk
        for photo in photos:
            name = target_name(SETTINGS, photo)
            (out / name).parent.mkdir(exist_ok=True)
            (out / name).touch()
            line = {"name": name, "output": name, "photo": photo.path, "kind": SETTINGS.kind, "seconds": 1.0}
            line |= {"settings": SETTINGS.digest, "key": key_of(SETTINGS, photo)}
            manifest.write(json.dumps(line) + "\n")


def most_megabytes() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photos", type=int, default=100_000)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        archive, out = Path(scratch, "photos"), Path(scratch, "out")
        archive.mkdir()
        write_archive(archive, given.photos)
        print(f"before:               {most_megabytes():.0f} MB")
        started = time.perf_counter()
        photos = photos_in([archive])
        print(f"found {len(photos)}:         {time.perf_counter() - started:.1f} s, {most_megabytes():.0f} MB")
        pretend_finished(out, photos)
        started = time.perf_counter()
        with Ledger(out) as ledger:
            count = run_batch(ledger, SETTINGS, photos, workers_here(1), ignore_progress)
        assert count.there_before == given.photos, count
        print(f"all there before:     {time.perf_counter() - started:.1f} s, {most_megabytes():.0f} MB")


if __name__ == "__main__":
    main()
