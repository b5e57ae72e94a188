"""The cases of fuzzing: who reads which damaged files.

A case is a pure function of (reader, seed, number), so that three words name a finding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks import fuzz_seeds as seeds
from benchmarks.fuzz_damage import Seed, damage, repair_png
from iibr_core.depth.models import cache as estimate_cache
from iibr_core.depth.models.preparation import USUAL_PREPARATION, read_preparation
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.lens_picture import read_lens_picture
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.light_fields.grids import read_grid
from iibr_core.formats.light_fields.light_field_formats import find_light_field, open_light_field
from iibr_core.formats.light_fields.llff import read_llff
from iibr_core.formats.light_fields.views import read_views
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.method.ray_transformer import TrainedWeights
from iibr_core.types import ImageSize, InputError
from viewer.app.preferences_store import load_preferences
from viewer.model.lens.aperture_mask import read_mask
from viewer.model.saved_settings import read_settings
from viewer.model.state.app_state import AppState

MAX_PIXELS = 100_000


@dataclass(frozen=True)
class Reader:
    """A reader of files: `read` gets the path of a damaged one; `prepare` puts beside it what it needs."""

    seeds: Callable[[], list[Seed]]
    read: Callable[[Path], object]
    prepare: Callable[[Path], None] = lambda folder: None


def case(name: str, seed: int, number: int) -> tuple[str, bytes]:
    """File name and bytes of a case."""
    return damage(_seeds_of(name), np.random.default_rng([seed, number, *name.encode()]))


def _read_photo(path: Path) -> None:
    pixels = read_photo(path, MAX_PIXELS).pixels
    assert pixels.ndim == 3
    assert pixels.shape[0] * pixels.shape[1] <= MAX_PIXELS
    assert np.isfinite(pixels).all()
    assert (pixels >= 0).all()


def _read_map(path: Path) -> None:
    assert np.isfinite(read_disparity(path, ImageSize(*seeds.SIZE)).values).all()


def _open_with_depth(path: Path) -> None:
    found = open_with_depth(path, max_pixels=MAX_PIXELS)
    assert found.disparity.values.shape == found.photo.size
    assert np.isfinite(found.disparity.values).all()


def _read_field(path: Path) -> None:
    scene = open_light_field(path.parent)
    assert scene.focal_px is None or 0 < scene.focal_px < np.inf
    assert len(list(read_views(scene)[1])) == 4


def _read_view_file(path: Path) -> None:
    scene = find_light_field(path)
    if scene is not None:
        size, views = read_views(scene)
        assert all(view.colors.shape == (*size, 3) for view in views)


def _four_views(folder: Path) -> None:
    for k in range(4):
        (folder / f"input_Cam{k:03d}.png").write_bytes(seeds.by_pillow("PNG"))


def _read_settings(path: Path) -> None:
    read_settings(path)


def _read_mask(path: Path) -> None:
    read_mask(path)


def _read_poses(path: Path) -> None:
    scene = read_llff(path.parent)
    assert scene is None or all(np.isfinite(view.offset).all() for view in scene.views)


def _view_and_lens(folder: Path) -> None:
    (folder / "views").mkdir(exist_ok=True)
    for path in (*(folder / "views" / f"v00_u0{u}.png" for u in range(2)), folder / "lens.png"):
        path.write_bytes(seeds.by_pillow("PNG"))


def _read_lens_picture(path: Path) -> None:
    scene = read_grid(path.parent)
    assert scene is not None
    found = read_lens_picture(scene, MAX_PIXELS)
    assert found is not None
    assert np.isfinite([found.focus_disparity, found.radius_views]).all()


def _read_preferences(path: Path) -> None:
    if load_preferences(AppState(), path.parent).notices:
        raise InputError("a notice says why")


def _read_estimate(path: Path) -> None:
    estimate_cache.cache_folder = lambda: path.parent
    if estimate_cache.load(path.stem) is None:
        raise InputError("as if there were none")


def _read_model_config(path: Path) -> None:
    read_preparation(path.parent, USUAL_PREPARATION)


def _read_weights(path: Path) -> None:
    TrainedWeights(path)


READERS: dict[str, Reader] = {
    "jpeg": Reader(seeds.jpegs, _read_photo),
    "png": Reader(seeds.pngs, _read_photo),
    "tiff": Reader(seeds.tiffs, _read_photo),
    "exr": Reader(seeds.exrs, _read_photo),
    "hdr": Reader(seeds.hdrs, _read_photo),
    "webp": Reader(lambda: [Seed("a.webp", seeds.by_pillow("WEBP", lossless=x)) for x in (True, False)], _read_photo),
    "pnm": Reader(seeds.pnms, _read_photo),
    "other": Reader(seeds.others, _read_photo),
    "heic": Reader(seeds.heics, _open_with_depth),
    "embedded": Reader(seeds.photos_with_depth, _open_with_depth),
    "pfm": Reader(seeds.pfms, _read_map),
    "npy": Reader(seeds.npys, _read_map),
    "map-png": Reader(lambda: [Seed("a_depth.png", seeds.by_pillow("PNG", "L"), repair_png)], _read_map),
    "cfg": Reader(seeds.cfgs, _read_field, _four_views),
    "view-files": Reader(seeds.view_files, _read_view_file),
    "poses": Reader(seeds.poses, _read_poses, _four_views),
    "lens": Reader(seeds.lens_pictures, _read_lens_picture, _view_and_lens),
    "preferences": Reader(seeds.preferences, _read_preferences),
    "estimates": Reader(seeds.estimates, _read_estimate),
    "model-config": Reader(seeds.model_configs, _read_model_config),
    "settings": Reader(seeds.saved_settings, _read_settings),
    "mask": Reader(seeds.pngs, _read_mask),
    "weights": Reader(seeds.weights, _read_weights),
}


@cache
def _seeds_of(name: str) -> list[Seed]:
    return READERS[name].seeds()
