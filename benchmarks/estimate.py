"""Measures what depth by a model costs beside the window: Depth Anything V2 Small as ONNX, with random weights.

python -m benchmarks.estimate [--photo PHOTO] [--out FILE]

Load (ONNX Runtime's import and the photo's preparation included), estimate, and the memory that both add are medians
over fresh processes of two threads. Turns of the window's loop, on a private X server, are counted by the processor
time of the drawing thread, from asking for the estimate until it has come and all views are made again.
"""

from __future__ import annotations

import shutil
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil

from benchmarks.harness.bench_scenes import DEMO
from benchmarks.harness.environment import set_environment, thread_variables
from benchmarks.harness.real_window import is_idle, open_window, run_until_idle
from benchmarks.harness.reports import emit, head, holds, parser_of, row, start
from benchmarks.harness.timing import Cost, added_bytes, in_own_process, median_cost
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimators.catalog import model_to_use
from iibr_core.depth.estimators.onnx_models import USUAL_PREPARATION, OnnxInput, run_onnx
from iibr_core.formats.images.photo import read_photo
from iibr_core.runtime.work import watched
from iibr_core.scenes.scene import Source
from iibr_core.types import ImageSize, InputError
from viewer.model.state.model_download import UseModel

THREADS, SIDE = 2, 518
LOAD_S, ESTIMATE_S, ADDED_MB, TURN_MS = 1.5, 1.2, 700, 50
"""Wanted: no more than that."""
BACKBONE = {"image_size": SIDE, "hidden_size": 384, "num_attention_heads": 6, "out_indices": [3, 6, 9, 12]}
"""Settings of Depth Anything V2 Small that differ from the library's."""


def main() -> None:
    parser = parser_of(__doc__, "repeats", "out")
    parser.add_argument("--photo", type=Path, default=DEMO, help="opened without the map beside it")
    options = parser.parse_args()
    if not options.photo.is_file():
        raise InputError(f"{options.photo}: no such file; name a photo")
    # An estimate that the user's cache has already would cost nothing.
    with (
        tempfile.TemporaryDirectory() as folder,
        set_environment({**thread_variables(THREADS), "XDG_CACHE_HOME": f"{folder}/cache"}),
    ):
        photo = Path(shutil.copy(options.photo, folder))
        emit(report(photo, Path(folder) / "model.onnx", options.repeats), options.out)


def report(photo: Path, model: Path, repeats: int) -> Iterator[str]:
    """model: where it is to be saved."""
    yield f"Load average before: {psutil.getloadavg()[0]:.1f}.\n"
    yield head("what", "wanted", "measured", "holds")
    in_own_process(save_model, model)
    loads, runs, added = zip(*(in_own_process(estimate, model, photo) for _ in range(repeats)))
    for what, costs, most in ("load", loads, LOAD_S), (f"estimate at {SIDE}x{SIDE}", runs, ESTIMATE_S):
        cost = median_cost(list(costs))
        said = f"{cost.wall_s:.2f} s, {cost.cpu_s:.2f} s of processor time"
        yield row(f"{what}, {THREADS} threads", f"<= {most} s", said, holds(cost.wall_s <= most))
    megabytes = float(np.median(added)) / 1e6
    fits = None if np.isnan(megabytes) else megabytes <= ADDED_MB
    weights = f"{model.stat().st_size / 1e6:.0f} MB of weights included"
    yield row("memory added", f"<= {ADDED_MB} MB", f"{megabytes:.0f} MB, {weights}", holds(fits))
    turns = turns_while_estimating(photo, model)
    slow = sum(turn > TURN_MS for turn in turns)
    said = f"largest {max(turns):.0f} ms, {slow} of {len(turns)} over {TURN_MS}"
    yield row("turns of the loop meanwhile", f"<= {TURN_MS} ms of processor time", said, holds(slow == 0))


def save_model(file: Path) -> None:
    """The architecture as an ONNX file; the same random weights each time."""
    import torch

    from tests.iibr_core.depth.random_networks import depth_anything_network, export_depth_anything, with_random_weights

    warnings.simplefilter("ignore")  # tracing warns of what it takes for constant
    torch.manual_seed(0)
    export_depth_anything(with_random_weights(depth_anything_network(BACKBONE)), file)


def estimate(file: Path, photo: Path) -> tuple[Cost, Cost, float]:
    """Return the costs of loading and of running in this process, and the most bytes that they add (NaN if unknown)."""
    model, pixels = model_to_use(DepthChoice(model=str(file))), read_photo(photo)
    assert model is not None
    wanted, marks = OnnxInput(USUAL_PREPARATION, ImageSize(SIDE, SIDE), is_metric=False), list[Cost]()

    def mark(*_: object) -> None:
        """Note when loading begins, and when running does."""
        marks.append(Cost(time.perf_counter(), time.process_time()))

    with watched(mark):
        added = added_bytes(lambda: run_onnx(model, wanted, pixels))
    mark()
    begun, loaded, done = marks
    return loaded + begun.times(-1), done + loaded.times(-1), added


def turns_while_estimating(photo: Path, model: Path) -> list[float]:
    """Processor time of the drawing thread in each turn of the loop, ms, until all views are made with the model's
    depth. Raises InputError where it gives none.
    """
    turns: list[float] = []
    with open_window(Source(str(photo))) as app:
        run_until_idle(app)
        app.do(UseModel(str(model)))
        while not (app.state.scene and app.state.scene.depth_model and is_idle(app)):
            before = time.thread_time()
            app.step()
            turns.append((time.thread_time() - before) * 1e3)
            if app.state.models.given_up:
                raise InputError(app.state.notices[-1].text)
    return turns


if __name__ == "__main__":
    start("benchmarks.estimate", main)
