"""How the time of a field grows with threads and with pixels, on a drawn scene."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.harness.bench_scenes import BenchScene, squares_scene
from benchmarks.harness.environment import set_environment, thread_variables
from benchmarks.harness.reports import head, row
from benchmarks.harness.timing import cost_of, in_own_process, make_field
from iibr_core.runtime.machine import core_count
from iibr_core.types import GridShape

THREADS = (1, 2, 4, 8, 16)
MEGAPIXELS = (0.25, 1.0, 3.0, 10.0)
FEW_VIEWS = GridShape(5, 5)
"""Views of 10 megapixels that fit into 6 GB."""


def thread_lines(repeats: int) -> Iterator[str]:
    """A drawn field made by 1 to 16 threads, as far as the machine goes, each in a process of its own."""
    yield f"\n## Threads\n\n{head('threads', 'seconds', 'times as fast as one')}"
    alone = 0.0
    for threads in (count for count in THREADS if count <= core_count()):
        with set_environment(thread_variables(threads)):
            seconds = in_own_process(field_seconds, 1024, repeats)
        alone = alone or seconds
        yield row(threads, f"{seconds:.2f}", f"{alone / seconds:.2f}")


def pixel_lines(repeats: int) -> Iterator[str]:
    """The same drawing from 0.25 to 10 megapixels."""
    yield f"\n## Pixels\n\n{head('megapixels', 'seconds', 'ns a pixel and view')}"
    costs = []
    for megapixels in MEGAPIXELS:
        side = round(1000 * megapixels**0.5)
        scene = squares_scene(side, 2.0, 16, FEW_VIEWS)
        costs.append(_field_cpu(scene, 1 if megapixels > 1 else repeats))
        views = len(scene.field)
        yield row(megapixels, f"{costs[-1]:.2f}", f"{1e9 * costs[-1] / (side * side * views):.0f}")
    exponent = np.polyfit(np.log(MEGAPIXELS), np.log(costs), 1)[0]
    yield f"\nProcessor time grows with pixels to the power of {exponent:.2f}."


def field_seconds(side: int, repeats: int) -> float:
    """Return the seconds by the clock for a field of a drawn scene, the best of a few rounds."""
    scene = squares_scene(side, 2.0, 16)
    make_field(scene)
    return min(cost_of(partial(make_field, scene)).wall_s for _ in range(repeats))


def _field_cpu(scene: BenchScene, repeats: int) -> float:
    return min(cost_of(partial(make_field, scene)).cpu_s for _ in range(repeats))
