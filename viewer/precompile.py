"""Compile the kernels that opening a photo needs, for an installation to bring along.

    python -P -m viewer.precompile iibr_core/_kernels

Opens small photos in every way: only so are kernels compiled for the arrays that they meet. Kernels of training and
evaluation are compiled when they are used.
"""

from __future__ import annotations

import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from iibr_core.beyond.free_cameras import FreeViews, inverse_depth_of, steered
from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.full_drawing import draw_full
from iibr_core.exports.full_picture import FullPicture
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.reader import read_map
from iibr_core.formats.maps.writer import write_map
from iibr_core.gloss.settings import GlossSurface
from iibr_core.runtime.compiling import COMPILING, FOLDER_VARIABLE
from iibr_core.runtime.machine import core_count
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.photo import load_photo, make_plan, prepare_brush
from iibr_core.scenes.scene import SceneReady, SceneRequest, Source
from iibr_core.scenes.scene_gloss import GlossRequest, make_maps
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, Camera
from viewer.model.demo_photo import demo_photo

PART = (slice(150, 310), slice(200, 400))
"""Part of the demo photo with edges, wires and slopes of every kind."""
GLOSSY_PIXELS = 250_000
"""Number of pixels of a photo whose disparity is smoothed for its normals, as in large photos."""


def main() -> None:
    """Replace the kernels in the folder named on the command line, with one process per core."""
    folder = Path(sys.argv[1]).absolute()
    print(COMPILING, file=sys.stderr)
    for path in folder.rglob("*.nb[ic]"):
        path.unlink()
    os.environ[FOLDER_VARIABLE] = str(folder)
    with ProcessPoolExecutor(core_count(), get_context("spawn")) as processes:
        list(processes.map(_run, STEPS))


def _run(step: str) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        STEPS[step](Path(scratch))


def _photo(scratch: Path, is_mapped: bool = True, is_hdr: bool = False) -> Source:
    """Write a part of the demo photo to a file."""
    photo = scratch / ("photo.exr" if is_hdr else "photo.png")
    colors = read_photo(demo_photo()).pixels[PART]
    write_image(photo, 4 * colors if is_hdr else np.round(255 * colors).astype(np.uint8))
    if is_mapped:
        # The map has a hole, and lies one pixel beside the photo: edge bands of measured maps are moved to it.
        disparity = np.roll(read_map(demo_photo().with_name("motorcycle_disparity.pfm"))[PART], 1, axis=1)
        disparity[:4, :4] = np.nan
        write_map(scratch / "photo_disparity.pfm", disparity)
    return Source(str(photo))


def _open(source: Source) -> SceneReady:
    """Open a photo as the window does and make its views."""
    ready, *_ = results_of(SceneRequest(0, source), lambda: CENTRE)
    assert isinstance(ready, SceneReady)
    return ready


def _open_with_small_maps(scratch: Path) -> None:
    """Open a photo with a small exact map, then with a soft one, as networks and phones make them."""
    source = _photo(scratch)
    disparity = np.nan_to_num(read_map(scratch / "photo_disparity.pfm"), nan=0.0) / np.float32(4)
    for small in (disparity[::4, ::4], disparity.reshape(40, 4, 50, 4).mean(axis=(1, 3))):
        write_map(scratch / "photo_disparity.pfm", np.ascontiguousarray(small))
        _open(source)


def _look_around(scratch: Path) -> None:
    """Make a view of a camera outside the plane of the views."""
    loaded = load_photo(_photo(scratch))
    size = loaded.photo.size
    camera = Camera(np.eye(3), np.zeros(3), size, (float(size.width),) * 2, (size.width / 2, size.height / 2), "")
    turned = steered(camera, 0.2, 0.2, 0.2)
    FreeViews(loaded.photo.pixels, inverse_depth_of(loaded.disparity.values, None), camera, [turned]).view(turned)


def _find_gloss(scratch: Path) -> None:
    """Find the normals of a glossy surface."""
    ready = next(results_of(SceneRequest(0, Source(str(demo_photo()), max_pixels=GLOSSY_PIXELS)), lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    make_maps(GlossRequest(GlossSurface(), ready.scene, ready.centre))


def _draw_at_own_size(scratch: Path) -> None:
    """Draw a picture through a lens at the photo's own size, with inpainted background."""
    small = replace(_photo(scratch), max_pixels=16_000)
    loaded = load_photo(small)
    plan = make_plan(small, loaded, 1.0)
    height, width = loaded.photo.size
    full = FullPicture(_open(small).scene, plan, loaded, Optics(aperture_diameter=3.0), ScreenSize(width, height))
    draw_full(full, lambda settings: np.zeros((settings.size_px.height, settings.size_px.width, 3), np.float32))


def _search_views(scratch: Path) -> None:
    """Open a light field without disparity."""
    texture = np.random.default_rng(0).integers(0, 255, (96, 96, 3), np.uint8)
    for row, column in np.ndindex(3, 3):
        write_image(scratch / f"v{row}_u{column}.png", np.roll(texture, (row, column), (0, 1)))
    _open(Source(str(scratch)))


STEPS = {
    "photo": lambda scratch: _open(_photo(scratch)),
    "views": lambda scratch: _open(replace(_photo(scratch), depth=DepthChoice(refine=False))),
    "light field": _search_views,
    "brush": lambda scratch: prepare_brush(),
    "camera": _look_around,
    "gloss": _find_gloss,
    "guess": lambda scratch: _open(replace(_photo(scratch, is_mapped=False), depth=DepthChoice(start="rough"))),
    "smaller": lambda scratch: _open(replace(_photo(scratch), max_pixels=160 * 200 // 2)),
    "small maps": _open_with_small_maps,
    "hdr": lambda scratch: _open(_photo(scratch, is_hdr=True)),
    "own size": _draw_at_own_size,
}


if __name__ == "__main__":
    main()
