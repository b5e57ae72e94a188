"""Web pages of light fields: how large, how near to the desktop's pictures, how fast and how heavy in a browser.

    python -m benchmarks.web [--data DATA]

The demo photo, and of DATA the light field `hci_antinous` and the photo `apple_pug_heic/pug.heic`, each in headless
Chromium with WebGL on the processor. Times are by the clock of a machine that does nothing else, if it does so.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from PIL import Image, ImageSequence

from benchmarks.harness.bench_scenes import DEMO
from benchmarks.harness.reports import emit, markdown, parser_of, start
from iibr_core.exports.kinds import EXPORTS, ExportOptions
from iibr_core.exports.source import ExportSource, open_for_export
from iibr_core.exports.web import make_page
from iibr_core.scenes.lens_limits import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ViewOffset, ViewUpdate
from tests.browser import Pipe, Tab, open_browser
from tests.web.conftest import canvas, set_lens, wait_until_still
from viewer.app.headless import HeadlessViewer
from viewer.model.state.optics_actions import MoveEye, SetAperture, SetFocus

KIND = EXPORTS["web"]


def main() -> None:
    options = parser_of(__doc__, "data").parse_args()
    scenes = {"demo, 5x5": Source(str(DEMO), grid=GridShape(5, 5))}
    if options.data:
        scenes["antinous"] = Source(str(options.data / "hci_antinous"))
        scenes["pug"] = Source(str(options.data / "apple_pug_heic" / "pug.heic"))
    rows = [row_of(name, source) for name, source in scenes.items()]
    names = ("page", "views", "MB", "FLIP", "pinhole, dB", "aperture, dB", "encoding, s", "first picture, s")
    emit([markdown((*names, "all views, s", "memory, MB", "requests"), rows)])


def row_of(name: str, source: Source) -> tuple[Any, ...]:
    """Return a row of the table."""
    opened = open_for_export(KIND, ExportOptions(), source, 1.0, LensChoice(), lambda scene: None, None)
    views = list(opened.views(with_disparity=True))
    begun = time.perf_counter()
    page, carried = make_page(Made(**vars(opened), made=tuple(views)), ExportOptions())
    seconds = time.perf_counter() - begun
    originals = {opened.scene.grid.offset(view.row, view.column): view.colors for view in views}
    flips = [flip(originals[place], frame) for place, frame in zip(carried.places, frames(carried.colors))]
    with tempfile.TemporaryDirectory() as folder, open_browser() as browser:
        path = Path(folder) / "page.html"
        path.write_bytes(page)
        tab, before = browser.new_tab(), memory_of(browser)
        shown = show(tab, path, carried.size.width, carried.size.height)
        tab.call("HeapProfiler.collectGarbage")
        memory = memory_of(browser) - before
        near = nearness(tab, source)
        requests = len(tab.requests)
    size = f"{len(carried.places)} of {carried.size.width}x{carried.size.height}"
    return (name, size, f"{len(page) / 1e6:.2f}", f"{np.mean(flips):.3f}", *near, f"{seconds:.1f}", *shown,
            f"{memory / 1e6:.0f}", requests)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Made(ExportSource):
    """A source whose views are in memory, to measure the time of writing only."""

    made: tuple[ViewUpdate, ...] = ()

    def views(self, *_: Any, **__: Any) -> Generator[ViewUpdate]:
        """Yield the views."""
        yield from self.made


def frames(files: tuple[bytes, ...]) -> Iterator[np.ndarray]:
    """The pictures of a page's files, in their order."""
    for data in files:
        with Image.open(BytesIO(data)) as image:
            for frame in ImageSequence.Iterator(image):
                yield np.asarray(frame.convert("RGB"))


def flip(reference: np.ndarray, picture: np.ndarray) -> float:
    import flip_evaluator

    pair = ((one / 255).astype(np.float32) for one in (reference, picture))
    return float(flip_evaluator.evaluate(*pair, "LDR")[1])


def show(tab: Tab, path: Path, width: int, height: int) -> tuple[str, str]:
    """Open a page; seconds until the first picture is painted, and until all views are there."""
    tab.prefer(prefers_reduced_motion="reduce")
    tab.resize(width, height)
    begun = time.perf_counter()
    tab.open(path.as_uri())
    tab.wait_until("document.getElementById('said').textContent === ''")
    whole = time.perf_counter() - begun
    wait_until_still(tab)
    first = tab.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    return f"{first / 1000:.2f}", f"{whole:.1f}"


def memory_of(browser: Pipe) -> int:
    """Bytes that the browser's processes have for themselves."""
    processes = psutil.Process(browser.process_id)
    return sum(one.memory_full_info().uss for one in (processes, *processes.children(recursive=True)))


def nearness(tab: Tab, source: Source) -> tuple[str, str]:
    """The least PSNR against the desktop's pictures of the same settings: pinholes, and open apertures."""
    found: dict[bool, list[float]] = {False: [], True: []}
    with HeadlessViewer() as viewer:
        viewer.open(source)
        far, near = viewer.scene.disparity_range_px
        widest, reach = max(viewer.scene.grid), (max(viewer.scene.grid) - 1) / 2
        aside = round(2.8 * reach) / 4
        settings = ((0, 0, 0, 0), (0.5, -0.25, 0, 0), (aside, -aside, 0, 0), (0, 0, 0.6, 0.6), (0.5, 0.5, 0.9, 0.8))
        for s, t, focus_share, open_share in settings:
            focus = far + focus_share * (near - far) if open_share else 0.0
            viewer.do(MoveEye(ViewOffset(t, s)), SetFocus(focus), SetAperture(open_share * widest))
            set_lens(tab, s, t, focus, open_share * widest)
            wait_until_still(tab)
            error = np.mean((canvas(tab).astype(float) - viewer.picture()) ** 2)
            found[open_share > 0].append(10 * np.log10(255**2 / max(error, 1e-9)))
    return f"{min(found[False]):.1f}", f"{min(found[True]):.1f}"


if __name__ == "__main__":
    start("benchmarks.web", main)
