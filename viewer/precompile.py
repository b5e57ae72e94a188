"""Compiles the kernels that opening a photo needs, for an installation to bring along: nobody waits for them then.

    python -P -m viewer.precompile iibr_core/_kernels

They are compiled by doing the real work on small photos, from reading to the last view: only so are they compiled for
just those arrays that they will meet. What training and evaluation need beside is compiled where it is used. Kernels
that only ever become part of others are left out: where the others are compiled, nobody asks for them.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, get_args

if TYPE_CHECKING:
    from viewer.model.state.scene import Source

ROOT = Path(__file__).resolve().parents[1]
PART = (slice(150, 310), slice(200, 400))
"""Of the demo photo: so small that compiling is nearly all the work, with edges, wires and slopes of every kind."""
MADE_OF = "made_of.sha256"
"""Beside the kernels, written after all of them: the digest of their sources."""
GLOSSY_PIXELS = 250_000
"""So many that normals are smoothed, as those of large photos are."""


def main() -> None:
    """Write the compiled kernels into the folder named on the command line, in place of what is there."""
    write_kernels(Path(sys.argv[1]).absolute())


def write_kernels(folder: Path) -> None:
    """Compile, for the kind of processor that `kernel_cache` settles on, and keep what a second process reads that does
    the same. Where this installation has brought along what was made of the same sources, that is taken.
    """
    from iibr_core.runtime.kernel_cache import PRECOMPILED

    made_of = digest_of_sources()
    if (PRECOMPILED / MADE_OF).is_file() and (PRECOMPILED / MADE_OF).read_text() == made_of:
        if folder != PRECOMPILED:
            shutil.rmtree(folder, ignore_errors=True)
            shutil.copytree(PRECOMPILED, folder, ignore=shutil.ignore_patterns(MADE_OF))
            (folder / MADE_OF).write_text(made_of)
        return
    for name in [name for name in os.environ if name.startswith("NUMBA_")]:
        del os.environ[name]
    os.environ["NUMBA_DISABLE_INTEL_SVML"] = "1"  # a library that not every machine has
    shutil.rmtree(folder, ignore_errors=True)
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as processes:
        processes.submit(_work_with, folder).result()
        read = processes.submit(_work_with, folder).result()
    for path in folder.rglob("*.nb?"):
        if str(path) not in read:
            path.unlink()
    (folder / MADE_OF).write_text(made_of)


def digest_of_sources(root: Path = ROOT) -> str:
    """Of all that decides which kernels there are, and what becomes of them."""
    from iibr_core.runtime.kernel_cache import numba

    parts = [sys.version, numba.__version__, str(numba.core.config.CPU_NAME)]
    for path in sorted(path for room in ("iibr_core", "viewer") for path in (root / room).rglob("*.py")):
        parts += [str(path.relative_to(root)), hashlib.sha256(path.read_bytes()).hexdigest()]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _work_with(folder: Path) -> set[str]:
    """Do all that needs kernels, in a process that has compiled nothing yet, with those in the folder; add what had to
    be compiled. Returns the files that were read.
    """
    read = set()
    sys.addaudithook(lambda event, arguments: read.add(str(arguments[0])) if event == "open" else None)
    with tempfile.TemporaryDirectory() as scratch:
        kept = Path(scratch) / "kernels"
        os.environ["NUMBA_CACHE_DIR"] = str(kept)
        from iibr_core.runtime import kernel_cache

        kernel_cache.PRECOMPILED = folder
        for source in _photos(Path(scratch)):
            _open(source)
        _paint()
        _look_around(source)
        _find_gloss(source)
        _draw_at_own_size(source)
        _open(_views_alone(Path(scratch)))
        _collect(kept, folder)
    return read


def _open(source: Source) -> None:
    """All that the window's worker does with a photo."""
    from viewer.background.scene_worker import SceneRequest, results_of
    from viewer.model.state.optics import CENTRE

    for _ in results_of(SceneRequest(0, source), lambda: False, lambda: CENTRE):
        pass


def _paint() -> None:
    """What the first stroke of the depth brush needs."""
    from viewer.background.loaded_photo import prepare_brush

    prepare_brush()


def _look_around(source: Source) -> None:
    """What a camera needs that leaves the plane of the views."""
    import numpy as np

    from iibr_core.generation.free_views import FreeViews, inverse_depth_of, steered
    from iibr_core.types import Camera
    from viewer.background.loaded_photo import load_photo

    loaded = load_photo(source)
    size = loaded.photo.size
    camera = Camera(np.eye(3), np.zeros(3), size, (float(size.width),) * 2, (size.width / 2, size.height / 2), "")
    turned = steered(camera, 0.2, 0.2, 0.2)
    FreeViews(loaded.photo.pixels, inverse_depth_of(loaded.disparity.values, None), camera, [turned]).view(turned)


def _find_gloss(source: Source) -> None:
    """What the window waits for when a surface becomes glossy, with a light that is to be found in the photo, too."""
    from iibr_core.rendering.gloss.settings import Gloss, GlossLight
    from viewer.background.gloss import GlossRequest, answer
    from viewer.background.scene_worker import SceneReady, SceneRequest, results_of
    from viewer.cli.demo import demo_photo
    from viewer.model.state.optics import CENTRE

    large = replace(source, path=str(demo_photo()), max_pixels=GLOSSY_PIXELS)
    ready = next(results_of(SceneRequest(0, large), lambda: False, lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    gloss = Gloss(light=GlossLight(color=(0.0, 0.0, 0.0)), photo_shines=True)
    answer(GlossRequest(gloss, ready.scene, ready.centre))


def _draw_at_own_size(source: Source) -> None:
    """What a picture at the photo's own size needs, with all that the photo hides, through a lens."""
    import numpy as np

    from viewer.app.full_picture import FullPicture
    from viewer.background.loaded_photo import load_photo, make_plan
    from viewer.background.scene_worker import SceneReady, SceneRequest, results_of
    from viewer.model.layout import ScreenSize
    from viewer.model.state.optics import CENTRE, Optics

    small = replace(source, max_pixels=16_000)
    loaded = load_photo(small)
    plan = make_plan(small, loaded, 1.0)
    ready = next(results_of(SceneRequest(0, small, loaded=loaded, plan=plan), lambda: False, lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    height, width = loaded.photo.size
    smaller = np.zeros((height, width, 3), np.float32)
    FullPicture(ready.scene, plan, loaded, Optics(aperture_diameter=3.0), ScreenSize(width, height), smaller).draw()


def _views_alone(scratch: Path) -> Source:
    """A light field without disparity: `iibr depth` looks for it in the same way."""
    import numpy as np

    from iibr_core.formats.images.photo import write_image
    from viewer.model.state.scene import Source

    folder = scratch / "field"
    folder.mkdir()
    texture = np.random.default_rng(0).integers(0, 255, (96, 96, 3), np.uint8)
    for row, column in np.ndindex(3, 3):
        write_image(folder / f"v{row}_u{column}.png", np.roll(texture, (row, column), (0, 1)))
    return Source(str(folder))


def _photos(scratch: Path) -> Iterator[Source]:
    """A part of the demo photo as files of every kind that is computed with in another way, and in every quality."""
    import numpy as np

    from iibr_core.depth.choice import DepthChoice
    from iibr_core.depth.search import open_with_depth
    from iibr_core.formats.images.photo import write_image
    from iibr_core.formats.maps.writer import write_map
    from iibr_core.types import Quality
    from viewer.cli.demo import demo_photo
    from viewer.model.state.scene import Source

    demo = open_with_depth(demo_photo(), DepthChoice(refine=0.0))
    # A pixel beside the photo, and with a hole: rims of measured maps are moved to it.
    colors, disparity = demo.photo.pixels[PART], np.roll(demo.disparity.values[PART], 1, axis=1)
    disparity[:4, :4] = np.nan
    photo, unmapped, hdr = (scratch / name for name in ("photo.png", "unmapped.png", "hdr.exr"))
    write_image(photo, np.round(255 * colors).astype(np.uint8))
    write_image(unmapped, np.round(255 * colors).astype(np.uint8))
    write_image(hdr, 4 * colors)
    for mapped in (photo, hdr):
        write_map(mapped.with_name(f"{mapped.stem}_disparity.pfm"), disparity)
    for quality in get_args(Quality):
        yield Source(str(photo), quality=quality)
    yield Source(str(photo), max_pixels=colors.size // 6)
    yield Source(str(unmapped), DepthChoice(start="rough"))
    yield Source(str(hdr))


def _collect(kept: Path, folder: Path) -> None:
    """From where Numba keeps them, under digests of the places of the sources, to folders named like the package's."""
    from iibr_core.runtime.kernel_cache import PACKAGE, numba

    locator = numba.core.caching._CacheLocator
    for place in (PACKAGE, *(path for path in PACKAGE.rglob("*") if path.is_dir())):
        compiled = kept / locator.get_suitable_cache_subpath(str(place / "any.py"))
        if compiled.is_dir():
            shutil.copytree(compiled, folder / place.relative_to(PACKAGE), dirs_exist_ok=True)


if __name__ == "__main__":
    main()
