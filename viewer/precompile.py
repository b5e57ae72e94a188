"""Compiles the kernels that opening a photo needs, for an installation to bring along: nobody waits for them then.

    python -P -m viewer.precompile iibr_core/_kernels [COMMAND ...]

As many processes as there are cores do the real work on small photos, from reading to the last view: only so are
kernels compiled for just those arrays that they will meet. All keep them in that one folder, where each finds those of
the others, and where what was left half done goes on. A command is run as soon as those of the first picture are
there; the rest follows beside it.

What training and evaluation need beside is compiled where it is used. Kernels that only ever become part of others are
left out: where the others are compiled, nobody asks for them.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import wait
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import psutil

from iibr_core.runtime.compiling import COMPILING
from iibr_core.runtime.machine import core_count
from iibr_core.runtime.tiling import Cancelled, ShouldStop, never
from iibr_core.types import InputError, Quality

if TYPE_CHECKING:
    from iibr_core.scenes.scene import Source

ROOT = Path(__file__).resolve().parents[1]
PART = (slice(150, 310), slice(200, 400))
"""Of the demo photo: so small that compiling is nearly all the work, with edges, wires and slopes of every kind."""
MADE_OF = f"made_of.py{sys.version_info.major}{sys.version_info.minor}{getattr(sys, 'abiflags', '')}"
"""Beside the kernels, written after all of them: of what. One for each Python, whose kernels lie side by side."""
OWN_FILE = re.compile(r".*\.nb[ci]|made_of\.\w+")
"""What it writes, and may remove."""
GLOSSY_PIXELS = 250_000
"""So many that normals are smoothed, as those of large photos are."""
LOOK_S = 0.5
"""How often it is asked whether to stop."""
LOWEST_PRIORITY: int = psutil.IDLE_PRIORITY_CLASS if sys.platform == "win32" else 19


def main() -> None:
    """Fill the folder named on the command line, and run the command that follows it."""
    folder, *command = sys.argv[1:]
    environment = dict(os.environ)
    for name in [name for name in os.environ if name.startswith("NUMBA_")]:
        del os.environ[name]
    os.environ["NUMBA_DISABLE_INTEL_SVML"] = "1"  # a library that not every machine has
    window: list[subprocess.Popen[bytes]] = []

    def begin() -> None:
        others = psutil.Process().children()
        if command:
            window.append(subprocess.Popen(command, env=environment))
            for process in (psutil.Process(), *others):
                process.nice(LOWEST_PRIORITY)

    try:
        write_kernels(Path(folder).absolute(), begin, lambda: bool(window) and window[0].poll() is not None)
    except InputError as error:
        print(error, file=sys.stderr)
        begin()
        if not window:
            sys.exit(2)
    except (Cancelled, KeyboardInterrupt):
        pass
    sys.exit(window[0].wait() if window else 0)


def write_kernels(folder: Path, begin: Callable[[], None] = lambda: None, should_stop: ShouldStop = never) -> None:
    """Have all kernels in the folder, compiled for the kind of processor that `kernel_cache` chooses, and none that
    nobody reads, or of other sources. begin: is called once those of the first picture are there.

    Raises InputError where the folder holds anything else, or no process can be started, Cancelled once should_stop is
    true after that.
    """
    _require_own_folder(folder)
    mark, sources = folder / MADE_OF, digest_of_sources()
    made_of = f"{sources}\n{_runtime()}\n"
    if _text(mark) == made_of:
        begin()
        return
    print(COMPILING, file=sys.stderr)
    mark.unlink(missing_ok=True)
    _take_steps(folder, begin, should_stop)
    read = _take_steps(folder, lambda: None, should_stop)
    marks = [path for path in folder.glob("made_of.*") if _text(path).startswith(sources)]
    for path in folder.rglob("*.nb?"):
        is_others = path in marks or any(f"{other.suffix}." in path.name for other in marks)
        if path.is_file() and str(path) not in read and not is_others:
            path.unlink()
    mark.write_text(made_of)


def _require_own_folder(folder: Path) -> None:
    """Raise InputError where a folder holds files other than kernels: it is somebody's, and named by mistake."""
    other = next((p for p in folder.rglob("*") if p.is_file() and not OWN_FILE.fullmatch(p.name)), None)
    if other is not None:
        raise InputError(f"{folder}: holds other files ({other.name}); give an empty folder")


def digest_of_sources(root: Path = ROOT) -> str:
    """Of all that decides which kernels there are, and what becomes of them."""
    digest = hashlib.sha256()
    for path in sorted(path for room in ("iibr_core", "viewer") for path in (root / room).rglob("*.py")):
        digest.update(f"{path.relative_to(root).as_posix()} {hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()


def _runtime() -> str:
    from iibr_core.runtime.kernel_cache import numba

    return f"{' '.join(sys.version.split())}; numba {numba.__version__}; {numba.core.config.CPU_NAME}"


def _text(path: Path) -> str:
    return path.read_text() if path.is_file() else ""


def _take_steps(folder: Path, begin: Callable[[], None], should_stop: ShouldStop) -> set[str]:
    """Each step in whichever process is free. Returns the files of kernels that were read or written."""
    from iibr_core.exports.batch.processes import local_workers

    with local_workers(core_count(), 1) as workers:
        steps = [workers.executor.submit(_work_in, folder, step) for step in STEPS]
        steps[0].result()
        begin()
        while not should_stop():
            if not wait(steps, LOOK_S).not_done:
                return set[str]().union(*(step.result() for step in steps))
    raise Cancelled


_used: set[str] = set()
"""The files that this process has read, or put in their place."""


def _note_use(event: str, arguments: tuple[Any, ...]) -> None:
    if event in ("open", "os.rename"):
        _used.add(str(arguments[event == "os.rename"]))


@cache
def _begin_to_fill(folder: Path) -> None:
    from iibr_core.runtime.kernel_cache import fill

    fill(folder)
    sys.addaudithook(_note_use)


def _work_in(folder: Path, step: Callable[[Path], None]) -> set[str]:
    """Do what needs kernels, with those in the folder; add what has to be compiled."""
    _begin_to_fill(folder)
    with tempfile.TemporaryDirectory() as scratch:
        step(Path(scratch))
    return _used


def _photo(scratch: Path, is_mapped: bool = True, is_hdr: bool = False) -> Source:
    """A part of the demo photo as a file."""
    import numpy as np

    from iibr_core.formats.images.photo import read_photo, write_image
    from iibr_core.formats.maps.reader import read_map
    from iibr_core.formats.maps.writer import write_map
    from iibr_core.scenes.scene import Source
    from viewer.model.demo_photo import demo_photo

    photo = scratch / ("photo.exr" if is_hdr else "photo.png")
    colors = read_photo(demo_photo()).pixels[PART]
    write_image(photo, 4 * colors if is_hdr else np.round(255 * colors).astype(np.uint8))
    if is_mapped:
        # A pixel beside the photo, and with a hole: edge bands of measured maps are moved to it.
        disparity = np.roll(read_map(demo_photo().with_name("motorcycle_disparity.pfm"))[PART], 1, axis=1)
        disparity[:4, :4] = np.nan
        write_map(scratch / "photo_disparity.pfm", disparity)
    return Source(str(photo))


def _open(source: Source) -> None:
    """All that the window's worker does with a photo."""
    from iibr_core.rendering.optics import CENTRE
    from iibr_core.scenes.opening import SceneRequest, results_of

    for _ in results_of(SceneRequest(0, source), lambda: False, lambda: CENTRE):
        pass


def _show_first_picture(scratch: Path) -> None:
    from iibr_core.rendering.optics import CENTRE
    from iibr_core.scenes.opening import SceneRequest, results_of

    next(results_of(SceneRequest(0, _photo(scratch)), lambda: False, lambda: CENTRE))


def _make_views(scratch: Path) -> None:
    """Without what comes before the first picture."""
    from iibr_core.depth.choice import DepthChoice

    _open(replace(_photo(scratch), depth=DepthChoice(refine=0.0)))


def _open_in(scratch: Path, quality: Quality) -> None:
    _open(replace(_photo(scratch), quality=quality))


def _open_smaller(scratch: Path) -> None:
    _open(replace(_photo(scratch), max_pixels=160 * 200 // 2))


def _open_guessed(scratch: Path) -> None:
    from iibr_core.depth.choice import DepthChoice

    _open(replace(_photo(scratch, is_mapped=False), depth=DepthChoice(start="rough")))


def _open_hdr(scratch: Path) -> None:
    _open(_photo(scratch, is_hdr=True))


def _paint(scratch: Path) -> None:
    """What the first stroke of the depth brush needs."""
    from iibr_core.scenes.loaded_photo import prepare_brush

    prepare_brush()


def _look_around(scratch: Path) -> None:
    """What a camera needs that leaves the plane of the views."""
    import numpy as np

    from iibr_core.generation.free_views import FreeViews, inverse_depth_of, steered
    from iibr_core.scenes.loaded_photo import load_photo
    from iibr_core.types import Camera

    loaded = load_photo(_photo(scratch))
    size = loaded.photo.size
    camera = Camera(np.eye(3), np.zeros(3), size, (float(size.width),) * 2, (size.width / 2, size.height / 2), "")
    turned = steered(camera, 0.2, 0.2, 0.2)
    FreeViews(loaded.photo.pixels, inverse_depth_of(loaded.disparity.values, None), camera, [turned]).view(turned)


def _find_gloss(scratch: Path) -> None:
    """What the window waits for when a surface becomes glossy, with a light that is to be found in the photo, too."""
    from iibr_core.rendering.gloss.gloss_settings import Gloss, GlossLight
    from iibr_core.rendering.optics import CENTRE
    from iibr_core.scenes.opening import SceneReady, SceneRequest, results_of
    from iibr_core.scenes.scene import Source
    from iibr_core.scenes.scene_gloss import GlossRequest, answer
    from viewer.model.demo_photo import demo_photo

    large = Source(str(demo_photo()), max_pixels=GLOSSY_PIXELS)
    ready = next(results_of(SceneRequest(0, large), lambda: False, lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    gloss = Gloss(light=GlossLight(color=(0.0, 0.0, 0.0)), photo_shines=True)
    answer(GlossRequest(gloss, ready.scene, ready.centre))


def _draw_at_own_size(scratch: Path) -> None:
    """What a picture at the photo's own size needs, with all that the photo hides, through a lens."""
    import numpy as np

    from iibr_core.exports.full_picture import FullPicture
    from iibr_core.rendering.optics import CENTRE, Optics
    from iibr_core.scenes.loaded_photo import load_photo
    from iibr_core.scenes.making import make_plan
    from iibr_core.scenes.opening import SceneReady, SceneRequest, results_of
    from iibr_core.scenes.screen_size import ScreenSize

    small = replace(_photo(scratch), max_pixels=16_000)
    loaded = load_photo(small)
    plan = make_plan(small, loaded, 1.0)
    ready = next(results_of(SceneRequest(0, small, loaded=loaded, plan=plan), lambda: False, lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    height, width = loaded.photo.size
    full = FullPicture(ready.scene, plan, loaded, Optics(aperture_diameter=3.0), ScreenSize(width, height))
    full.make(lambda settings: np.zeros((settings.size_px.height, settings.size_px.width, 3), np.float32))


def _search_views(scratch: Path) -> None:
    """A light field without disparity: `iibr depth` looks for it in the same way."""
    import numpy as np

    from iibr_core.formats.images.photo import write_image
    from iibr_core.scenes.scene import Source

    folder = scratch / "field"
    folder.mkdir()
    texture = np.random.default_rng(0).integers(0, 255, (96, 96, 3), np.uint8)
    for row, column in np.ndindex(3, 3):
        write_image(folder / f"v{row}_u{column}.png", np.roll(texture, (row, column), (0, 1)))
    _open(Source(str(folder)))


STEPS: tuple[Callable[[Path], None], ...] = (
    _show_first_picture,
    _make_views,
    _search_views,
    _paint,
    _look_around,
    _find_gloss,
    _open_guessed,
    *(partial(_open_in, quality=quality) for quality in get_args(Quality)),
    _open_smaller,
    _open_hdr,
    _draw_at_own_size,
)
"""The first picture first; steps that begin together compile little that is the same."""


if __name__ == "__main__":
    main()
