"""Facts that people get of a file or folder: as photo, as light field, as map, as cameras; or the reason why not."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from iibr_core.formats.images.metadata import camera_facts, caption_in
from iibr_core.formats.images.open_picture import open_picture, read_metadata
from iibr_core.formats.images.photo import read_photo, read_thumbnail
from iibr_core.formats.light_fields.light_field_formats import find_light_field, is_light_field, open_light_field
from iibr_core.formats.light_fields.views import disparity_range, read_views, row_step_of, view_offsets
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.reader import read_map_file, read_map_size
from iibr_core.formats.poses import read_named_poses
from iibr_core.types import ImageSize, InputError
from tests.iibr_core.facts import colors, spread


def photo_facts(path: Path) -> dict[str, Any]:
    """Return what is read of a photo, at its own size, at a quarter of its pixels, and as a thumbnail."""
    return {
        "photo": or_reason(path, _photo), "thumbnail": or_reason(path, _thumbnail),
        "field": or_reason(path, lambda path: None if find_light_field(path) is None else _field(path)),
    }  # fmt: skip


def field_facts(path: Path) -> dict[str, Any]:
    """Return what is read of a light field: its grid, the places of its views, some views and maps."""
    return {"is_field": is_light_field(path), "field": or_reason(path, _field)}


def map_facts(path: Path) -> dict[str, Any]:
    """Return what is read of a map, and as disparity of a view of 64x96 pixels with scale 0.5."""
    return {"map": or_reason(path, _map), "disparity": or_reason(path, _disparity)}


def camera_poses(path: Path) -> dict[str, Any]:
    """Return the cameras of a file or folder, and the light field that they make."""
    return {"cameras": or_reason(path, _cameras), "field": or_reason(path, _field)}


def or_reason(path: Path, read: Callable[[Path], Any]) -> Any:
    """Return what is read, or the error without places and words of libraries."""
    try:
        return read(path)
    except InputError as error:
        text = str(error).replace(str(path), "<path>").replace(str(path.parent), "<folder>")
        return re.sub(r"\((?:[^()]|\([^()]*\))*\)(?=;)", "(...)", text)


def _photo(path: Path) -> dict[str, Any]:
    photo, opened, metadata = read_photo(path), open_picture(path), read_metadata(path)
    smaller = read_photo(path, math.prod(photo.size) // 4, keeps_primaries=True)
    return {
        "size": list(photo.size), "name": photo.name, "focal_px": photo.focal_px, "is_hdr": photo.is_hdr,
        "notes": photo.notes, "colors": _colors(photo.pixels), "values": spread(photo.pixels),
        "stored": [*opened.size, opened.orientation, opened.kind], "upright": list(opened.upright_size),
        "smaller": [*smaller.size, smaller.color_space.name, smaller.focal_px, *smaller.notes],
        "smaller_colors": _colors(smaller.pixels), "caption": list(vars(caption_in(metadata)).values()),
        "facts": camera_facts(metadata),
    }  # fmt: skip


def _thumbnail(path: Path) -> list[Any]:
    small = read_thumbnail(path, ImageSize(24, 30))
    return [*small.shape, *colors(small)]


def _colors(encoded: np.ndarray) -> list[str]:
    return colors(np.rint(255 * np.clip(encoded, 0, 1)))


def _field(path: Path) -> dict[str, Any]:
    scene = open_light_field(path)
    places = [[view.name, *(view.place or ()), *at] for view, at in zip(scene.views, view_offsets(scene))]
    size, views = read_views(scene)
    first, *others = views
    return {
        "name": scene.name, "layout": scene.layout, "grid": scene.grid, "centre": scene.centre, "notes": scene.notes,
        "focal_px": scene.focal_px, "infinity_px": scene.infinity_px, "is_hdr": scene.is_hdr,
        "is_stated": [scene.is_stated, scene.is_guess, scene.stated_grid], "numbers": scene.numbers[:3],
        "places": places[:4] + places[-2:], "range": disparity_range(scene), "row_step": row_step_of(scene),
        "size": list(size), "order": [[view.row, view.column] for view in (first, *others[:3])],
        "views": [_view(view) for view in (first, others[0], others[-1])],
    }  # fmt: skip


def _view(view: Any) -> list[Any]:
    stored = view.colors if view.colors.dtype == np.uint8 else np.rint(255 * np.clip(view.colors.astype(float), 0, 1))
    known = None if view.disparity is None else spread(view.disparity)
    return [view.row, view.column, view.colors.dtype.name, known, *colors(stored)]


def _map(path: Path) -> dict[str, Any]:
    found = read_map_file(path)
    known, zeros = np.isfinite(found.values), 0 if found.is_zero is None else int(found.is_zero.sum())
    return {
        "shape": list(found.values.shape), "size": list(read_map_size(path)), "numbers": found.numbers,
        "largest": found.largest, "zeros": zeros, "unknown": int((~known).sum()), "name": found.name,
        "notes": found.notes, "text": found.text and found.text.meaning, "values": spread(found.values[known]),
        "corners": [float(found.values[at]) if known[at] else None for at in ((0, 0), (0, -1), (-1, 0), (-1, -1))],
    }  # fmt: skip


def _disparity(path: Path) -> dict[str, Any]:
    found = read_disparity(path, ImageSize(64, 96), 0.5)
    unknown = 0 if found.unknown is None else int(found.unknown.sum())
    corners = [float(found.values[at]) for at in ((0, 0), (0, -1), (-1, 0), (-1, -1), (31, 60))]
    return {"values": spread(found.values), "corners": corners, "notes": found.notes, "unknown": unknown}


def _cameras(path: Path) -> list[Any]:
    named = read_named_poses(path)
    return [
        [name, *camera.position, *np.ravel(camera.world_from_camera), *camera.size, *camera.focal_px,
         *camera.centre_px, camera.depth_range]
        for name, camera in named[:3]
    ]  # fmt: skip
