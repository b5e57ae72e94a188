"""Speed of the procedural scenes that training learns from, in rays (samples) a second.

python -m benchmarks.scenes [--scenes 24] [--size 512x512] [--samples 3]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import ImageSize, ViewOffset

OFFSETS = (ViewOffset(0.0, 0.0), ViewOffset(-4.0, 4.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=24)
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--samples", type=int, default=3)
    args = parser.parse_args()
    width, height = map(int, args.size.split("x"))
    rng = np.random.default_rng(0)
    render(random_scene(rng, ImageSize(16, 16), 1.0), ImageSize(16, 16), OFFSETS[0])  # compiles
    rates = []
    for _ in range(args.scenes):
        scene = random_scene(rng, ImageSize(height, width), float(np.exp(rng.uniform(np.log(0.25), np.log(3.75)))))
        start = time.perf_counter()
        for offset in OFFSETS:
            render(scene, ImageSize(height, width), offset, args.samples)
        rays = len(OFFSETS) * height * width * args.samples**2
        rates.append(rays / (time.perf_counter() - start) / 1e6)
    print(f"{args.scenes} scenes of {args.size}, {args.samples} x {args.samples} rays a pixel: million rays a second")
    print(f"median {np.median(rates):.1f}, least {min(rates):.1f}, most {max(rates):.1f}")


if __name__ == "__main__":
    main()
