"""How long depth by a trained model takes: `python -m benchmarks.estimator [PHOTO]`, Depth Anything V2 Small.

Random weights serve: time does not depend on them. Each step apart, best of several rounds; processor time beside wall
time, which others on the machine lengthen.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from iibr_core.depth.models import estimate_cache
from iibr_core.depth.models.catalog import LocalModel
from iibr_core.depth.models.transformers_models import estimate_with
from iibr_core.depth.search import resize_estimate
from iibr_core.formats.images.photo import read_photo
from iibr_core.types import ImageSize, Photo

SIZE = ImageSize(864, 1152)  # 1 MP
GOAL_S = 3.0
PREPROCESSOR = (
    '{"size": {"height": 518, "width": 518}, "keep_aspect_ratio": true, "ensure_multiple_of": 14,'
    ' "image_mean": [0.485, 0.456, 0.406], "image_std": [0.229, 0.224, 0.225]}'
)


def model_in(folder: Path) -> LocalModel:
    """Depth Anything V2 Small as published, but for the numbers in it."""
    import torch
    from transformers import DepthAnythingConfig, DepthAnythingForDepthEstimation

    torch.manual_seed(0)
    network = DepthAnythingForDepthEstimation(DepthAnythingConfig())
    with torch.no_grad():
        for weights in network.parameters():
            if weights.ndim > 1:
                weights.normal_(0, weights[0].numel() ** -0.5)
    network.save_pretrained(folder)
    (folder / "preprocessor_config.json").write_text(PREPROCESSOR)
    return LocalModel("Depth Anything V2 Small (random weights)", folder)


def time_rounds(what: str, run: Callable[[], object], rounds: int) -> float:
    """Best wall time of several rounds, printed with the processor time of that round."""
    best = (float("inf"), 0.0)
    for _ in range(rounds):
        wall, processor = time.perf_counter(), time.process_time()
        run()
        best = min(best, (time.perf_counter() - wall, time.process_time() - processor))
    print(f"{what:40} {best[0]:6.2f} s   {best[1]:6.2f} s of processor time")
    return best[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("photo", nargs="?", type=Path, help="made smaller than 1 MP; noise without")
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    photo = Photo(np.random.default_rng(0).random((*SIZE, 3), np.float32), 1000.0, "noise")
    if arguments.photo is not None:
        photo = read_photo(arguments.photo, SIZE[0] * SIZE[1])
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder) / "cache"
        estimate_cache.cache_folder = lambda: cache
        model = model_in(Path(folder))

        def anew() -> object:
            for path in cache.glob("*"):
                path.unlink()
            return resize_estimate(estimate_with(model, photo), photo.size)

        print(f"{photo.size[1]}x{photo.size[0]}, {model.title}, best of {arguments.rounds}")
        anew()  # imports and compiles
        seconds = time_rounds("photo to depth at the photo's size", anew, arguments.rounds)
        time_rounds(
            "the same from the cache",
            lambda: resize_estimate(estimate_with(model, photo), photo.size),
            arguments.rounds,
        )
        print(f"goal: {GOAL_S:g} s, {'met' if seconds <= GOAL_S else 'missed'}")


if __name__ == "__main__":
    main()
