"""Measure exported web pages in three browser engines, each page beside the desktop's pictures of the same scene.

    python -m benchmarks pages [--data DATA] [--only demo,antinous,pug] [--engines chromium,firefox,webkit]

DATA: a folder with antinous of the HCI data set and the HEIC file of a pug. A page is opened at the size of its
views, and as a phone shows it. Pinhole, aperture: the least PSNR in dB of three and two pictures against the desktop's.
Colours, FLIP: means of PSNR and FLIP where three views were taken. s: seconds until the last view is shown. Memory:
bytes that Chromium's renderers and graphics process hold beyond an empty page.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np

from benchmarks.report import is_wanted, markdown
from iibr_core.evaluation.metrics import bounded_psnr, flip
from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import FloatImage, ViewOffset
from tests.browsers.chromium import Tab
from tests.browsers.engines import ENGINES, open_engine
from tests.browsers.local_site import serve_site
from tests.browsers.page import Page
from tests.web.conftest import canvas, set_lens
from viewer.cli.main import app
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens
from viewer.model.action import do

DEMO = resource_folder("assets") / "motorcycle" / "motorcycle.png"
SCENES = {"antinous": "hci_antinous", "pug": "apple_pug_heic/pug.heic"}
"""Scenes of DATA by name."""
LARGEST, PHONE = ScreenSize(1200, 800), ScreenSize(390, 844)
"""Largest size of a page on a desk; size on a phone."""
PLACES, APERTURES = (ViewOffset(-0.25, 0.5), ViewOffset(1.25, -1.5), ViewOffset(2.0, 2.0)), (1.0, 3.0)
"""Viewpoints; diameters of apertures, in view steps."""
VIEWS = ViewOffset(0.0, 0.0), ViewOffset(-1.0, 1.0), ViewOffset(2.0, 2.0)
"""Viewpoints of views."""
HAS_LOADED = "!document.getElementById('status').textContent.startsWith('Opening')"
IS_STILL = "document.documentElement.dataset.state === 'still'"
NAMES = (
    "page", "MB", "engine", "views", "s", "pinhole", "aperture", "pinhole, phone", "aperture, phone", "colours", "FLIP",
    "memory, MB",
)  # fmt: skip


def main() -> None:
    """Export the pages and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--only", default="", help="words that names of scenes contain, by commas")
    parser.add_argument("--engines", default="", help="words that names of engines contain, by commas")
    options = parser.parse_args()
    paths = {"demo": DEMO, **{name: options.data / place for name, place in SCENES.items() if options.data}}
    wanted = {name: path for name, path in paths.items() if is_wanted(name, options.only)}
    engines = [name for name in ENGINES if is_wanted(name, options.engines)]
    with tempfile.TemporaryDirectory() as folder:
        print(markdown(NAMES, (row for name in wanted for row in rows(name, wanted[name], engines, Path(folder)))))


def rows(name: str, path: Path, engines: Iterable[str], folder: Path) -> Iterator[list[object]]:
    """Yield the rows of a scene, one an engine."""
    file = folder / f"{name}.html"
    with redirect_stdout(sys.stderr):
        app(["export", str(path), "--to", "web", "-o", str(file)], standalone_mode=False)
    with OffscreenScene("egl") as desktop, serve_site() as site:
        desktop.open(Source(str(path)))
        for engine in engines:
            with open_engine(engine, site) as page:
                yield [name, f"{file.stat().st_size / 1e6:.2f}", engine, *figures(page, file, desktop)]


def figures(page: Page, file: Path, desktop: OffscreenScene) -> Iterator[str]:
    """Yield the figures of a page in an engine."""
    page.resize(*map(min, desktop.scene.size, LARGEST))
    page.open("about:blank")
    empty = page.memory() if isinstance(page, Tab) else 0
    page.open(file.as_uri())
    page.wait_until(HAS_LOADED)
    seconds = page.evaluate("performance.now() / 1000")
    page.wait_until(IS_STILL)
    held = f"{(page.memory() - empty) / 1e6:.0f}" if isinstance(page, Tab) else ""
    yield page.evaluate("document.documentElement.dataset.views")
    yield f"{seconds:.1f}"
    views = [pair(page, desktop, place, 0.0) for place in VIEWS]
    colours = [f"{np.mean([judge(*view) for view in views]):.3g}" for judge in (bounded_psnr, flip)]
    yield from least(page, desktop)
    page.resize(*PHONE)
    yield from least(page, desktop)
    yield from (*colours, held)


def least(page: Page, desktop: OffscreenScene) -> Iterator[str]:
    """Yield the least PSNR of pinhole pictures, and that of pictures with an aperture."""
    yield f"{min(bounded_psnr(*pair(page, desktop, place, 0.0)) for place in PLACES):.1f}"
    yield f"{min(bounded_psnr(*pair(page, desktop, PLACES[0], aperture)) for aperture in APERTURES):.1f}"


def pair(page: Page, desktop: OffscreenScene, place: ViewOffset, aperture: float) -> tuple[FloatImage, FloatImage]:
    """Return what the canvas shows and the desktop's picture of the same size, focused in the middle of the range."""
    focus = float(page.evaluate("(+document.getElementById('focus').min + +document.getElementById('focus').max) / 2"))
    set_lens(page, place.s, place.t, focus, aperture)
    page.wait_until(IS_STILL)
    drawn = canvas(page)
    verbs = (lens.move_eye, place), (lens.set_focus, focus), (lens.set_aperture, aperture)
    desktop.do(*(do(verb, value) for verb, value in verbs))
    picture = desktop.picture(ScreenSize(*drawn.shape[1::-1]))
    return drawn / np.float32(255), picture / np.float32(255)


if __name__ == "__main__":
    main()
