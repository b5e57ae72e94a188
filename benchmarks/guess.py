"""Judge the guess of depth without a model: is the nearer of two points guessed nearer?

    python -m benchmarks guess --data DATA

Ordered: share of the pairs of points whose disparities differ by more than a tenth of the range that the guess, or a
ramp (height in the picture alone), orders as the known map does. `compare --maps guess` judges the views of a guess.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.report import markdown
from benchmarks.scenes import MAX_PIXELS, data_scenes, estimate_disparity
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.types import FloatImage


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of scenes, and of photos with depth inside")
    parser.add_argument("--max-pixels", type=int, default=MAX_PIXELS)
    options = parser.parse_args()
    print(table(known_maps(options.data, options.max_pixels)))


def table(maps: Iterator[tuple[str, FloatImage, FloatImage]]) -> str:
    """Return the table. maps: name, photo (H, W, 3) and known disparity (H, W)."""
    shares = {}
    for name, photo, known in maps:
        ramp = np.indices(known.shape)[0]
        shares[name] = [ordered_share(values, known) for values in (estimate_disparity(photo, "rough"), ramp)]
    rows = [*shares.items(), ("mean", np.mean(list(shares.values()), axis=0))]
    return markdown(("scene", "ordered: guess", "ramp"), ((name, *(f"{s:.3f}" for s in found)) for name, found in rows))


def known_maps(data: Path, max_pixels: int) -> Iterator[tuple[str, FloatImage, FloatImage]]:
    """Yield name, photo and disparity of the scenes of a folder, and of its photos that hold depth."""
    for scene in data_scenes(data, max_pixels=max_pixels):
        yield scene.name, scene.photo, scene.disparity
    for path in sorted(path for path in data.glob("*/*") if path.suffix in (".jpg", ".heic")):
        found = open_with_depth(path, DepthChoice(start="embedded", refine=False), max_pixels)
        if found.origin.kind == "embedded":
            yield path.parent.name, found.photo.pixels, found.disparity.values


def ordered_share(guess: np.ndarray, known: FloatImage) -> float:
    """Return the share of random pairs, far apart in depth, that two maps (H, W) order alike; ties count half."""
    places = np.random.default_rng(0).integers(0, known.size, (2, 400_000))
    low, high = np.percentile(known, (1, 99))
    apart, guessed = (values.ravel()[places[0]] - values.ravel()[places[1]] for values in (known, guess))
    counts = np.abs(apart) > 0.1 * (high - low)
    return float(np.mean(0.5 + 0.5 * np.sign(apart[counts]) * np.sign(guessed[counts])))


if __name__ == "__main__":
    main()
