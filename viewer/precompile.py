"""Compiles the kernels that opening a photo needs, for an installation to bring along: nobody waits for them then.

    python -P -m viewer.precompile iibr_core/_kernels

They are compiled by doing the real work on small photos, from reading to the last view: only so are they compiled for
just those arrays that they will meet. What training and evaluation need beside is compiled where it is used.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

if TYPE_CHECKING:
    from viewer.model.state.scene import Source

PART = (slice(150, 310), slice(200, 400))
"""Of the demo photo: so small that compiling is nearly all the work, with edges, wires and slopes of every kind."""
GLOSSY_PIXELS = 250_000
"""So many that normals are smoothed, as those of large photos are."""


def main() -> None:
    """Write the compiled kernels into the folder named on the command line, in place of what is there."""
    write_kernels(Path(sys.argv[1]).absolute())


def write_kernels(folder: Path) -> None:
    """Compile, in a process that has compiled nothing yet, for the kind of processor that `kernel_cache` settles on."""
    for name in [name for name in os.environ if name.startswith("NUMBA_")]:
        del os.environ[name]
    os.environ["NUMBA_DISABLE_INTEL_SVML"] = "1"  # a library that not every machine has
    with tempfile.TemporaryDirectory() as scratch:
        kept = Path(scratch) / "kernels"
        os.environ["NUMBA_CACHE_DIR"] = str(kept)
        shutil.rmtree(folder, ignore_errors=True)
        from iibr_core.runtime import kernel_cache

        kernel_cache.PRECOMPILED = folder  # it is empty: nothing comes from an earlier run
        for source in _photos(Path(scratch)):
            _open(source)
        _paint()
        _look_around(source)
        _find_gloss(source)
        _collect(kept, folder)


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
            shutil.copytree(compiled, folder / place.relative_to(PACKAGE))


if __name__ == "__main__":
    main()
