"""Compile the kernels that opening a photo needs, for an installation to bring along.

    python -P -m viewer.precompile iibr_core/_kernels

It does the real work on small photos, from reading to the last view: only so are kernels compiled for just those arrays
that they will meet. What training and evaluation need beside is compiled where it is used.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from iibr_core.beyond.free_cameras import FreeViews, inverse_depth_of, steered
from iibr_core.beyond.optics import CENTRE, Optics
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
from iibr_core.types import Camera, InputError
from viewer.model.demo_photo import demo_photo

if TYPE_CHECKING:
    from iibr_core.scenes.scene import Source

PART = (slice(150, 310), slice(200, 400))
"""Part of the demo photo with edges, wires and slopes of every kind; small: nearly all the work is compiling."""
GLOSSY_PIXELS = 250_000
"""Pixels of a photo whose disparity is smoothed for its normals, as in large photos."""
KERNEL_FILES = (".nbi", ".nbc")


def main() -> None:
    """Fill the folder named on the command line with compiled kernels. Raises SystemExit."""
    try:
        write_kernels(Path(sys.argv[1]).absolute())
    except InputError as error:
        print(f"iibr: {error}", file=sys.stderr)
        sys.exit(2)


def write_kernels(folder: Path) -> None:
    """Compile all kernels into a fresh folder, with as many processes as there are cores, and put it in the place of
    `folder`.

    Raises InputError where that holds files that are no kernels.
    """
    other = next((path for path in folder.rglob("*") if path.is_file() and path.suffix not in KERNEL_FILES), None)
    if other is not None:
        raise InputError(f"{folder}: holds other files ({other.name}); give an empty folder")
    print(COMPILING, file=sys.stderr)
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        fresh = Path(scratch) / "kernels"
        os.environ[FOLDER_VARIABLE] = str(fresh)
        with ProcessPoolExecutor(core_count(), get_context("spawn")) as processes:
            list(processes.map(_take, STEPS))
        shutil.rmtree(folder, ignore_errors=True)
        fresh.rename(folder)


def _take(step: Callable[[Path], None]) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        step(Path(scratch))


def _photo(scratch: Path, is_mapped: bool = True, is_hdr: bool = False) -> Source:
    """A part of the demo photo as a file."""
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
    for _ in results_of(SceneRequest(0, source), lambda: CENTRE):
        pass


def _show_first_picture(scratch: Path) -> None:
    next(results_of(SceneRequest(0, _photo(scratch)), lambda: CENTRE))


def _make_views(scratch: Path) -> None:
    """Make the views, without what comes before the first picture."""
    _open(replace(_photo(scratch), depth=DepthChoice(refine=False)))


def _open_smaller(scratch: Path) -> None:
    _open(replace(_photo(scratch), max_pixels=160 * 200 // 2))


def _open_with_small_maps(scratch: Path) -> None:
    """Open a photo with a small exact map, then with a soft one, as networks and phones make them."""
    source = _photo(scratch)
    disparity = np.nan_to_num(read_map(scratch / "photo_disparity.pfm"), nan=0.0) / np.float32(4)
    for small in (disparity[::4, ::4], disparity.reshape(40, 4, 50, 4).mean(axis=(1, 3))):
        write_map(scratch / "photo_disparity.pfm", np.ascontiguousarray(small))
        _open(source)


def _open_guessed(scratch: Path) -> None:
    _open(replace(_photo(scratch, is_mapped=False), depth=DepthChoice(start="rough")))


def _open_hdr(scratch: Path) -> None:
    _open(_photo(scratch, is_hdr=True))


def _paint(scratch: Path) -> None:
    """Prepare the first stroke of the depth brush."""
    prepare_brush()


def _look_around(scratch: Path) -> None:
    """Make a view of a camera outside the plane of the views."""
    loaded = load_photo(_photo(scratch))
    size = loaded.photo.size
    camera = Camera(np.eye(3), np.zeros(3), size, (float(size.width),) * 2, (size.width / 2, size.height / 2), "")
    turned = steered(camera, 0.2, 0.2, 0.2)
    FreeViews(loaded.photo.pixels, inverse_depth_of(loaded.disparity.values, None), camera, [turned]).view(turned)


def _find_gloss(scratch: Path) -> None:
    """Find the normals of a glossy surface."""
    large = Source(str(demo_photo()), max_pixels=GLOSSY_PIXELS)
    ready = next(results_of(SceneRequest(0, large), lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    make_maps(GlossRequest(GlossSurface(), ready.scene, ready.centre))


def _draw_at_own_size(scratch: Path) -> None:
    """Draw a picture at the photo's own size, with inpainted background, through a lens."""
    small = replace(_photo(scratch), max_pixels=16_000)
    loaded = load_photo(small)
    plan = make_plan(small, loaded, 1.0)
    ready = next(results_of(SceneRequest(0, small, loaded=loaded, plan=plan), lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    height, width = loaded.photo.size
    full = FullPicture(ready.scene, plan, loaded, Optics(aperture_diameter=3.0), ScreenSize(width, height))
    draw_full(full, lambda settings: np.zeros((settings.size_px.height, settings.size_px.width, 3), np.float32))


def _search_views(scratch: Path) -> None:
    """A light field without disparity: `iibr depth` looks for it in the same way."""
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
    _open_smaller,
    _open_with_small_maps,
    _open_hdr,
    _draw_at_own_size,
)


if __name__ == "__main__":
    main()
