"""Middlebury stereo: pairs of 2014 and 2021 (im0, im1, disp0.pfm) and rows of views of 2001 to 2006 (im0..im8 or
view0..view6) with ground truth for two of them.

Pictures are rectified and evenly spaced, from left to right; one view step is the distance of neighbours.
"""

from __future__ import annotations

import re
from pathlib import Path

from iibr_core.formats.images.decode import read_size
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import (
    KnownDisparity,
    KnownView,
    MultiView,
    maps_in,
    pictures_in,
    place_on_grid,
)
from iibr_core.types import ViewOffset

NAME = re.compile(r"(im|view)(\d)$")
FULL_WIDTH = {"im": 1800, "view": 1350}
"""Widths of full-size pictures of 2003, and of 2005 and 2006: smaller copies store disparity times the same ratio."""
TRUTH_AT = {"im": (2, 6), "view": (1, 5)}
STEPS_BETWEEN_TRUTHS = 4
SCALE_2001 = 8.0
MAX_WIDTH_2001 = 440
QUANTIZED = (".png", ".pgm")


def read_middlebury(folder: Path) -> MultiView | None:
    """Return the views of a Middlebury folder, None for other folders. In maps, unknown disparity is infinite or 0."""
    named = {
        (match[1], int(match[2])): path for path in pictures_in(folder) if (match := NAME.match(path.stem.lower()))
    }
    if len(named) < 2 or len({kind for kind, _ in named}) > 1:
        return None
    kind = next(iter(named))[0]
    if (folder / "disp0.pfm").is_file() and set(named) == {("im", 0), ("im", 1)}:
        maps = {n: KnownDisparity(path) for n in (0, 1) if (path := folder / f"disp{n}.pfm").is_file()}
        layout = "Middlebury pair"
    else:
        maps, layout = _coded_maps(folder, kind, next(iter(named.values()))), f"Middlebury, {len(named)} views"
    numbers = sorted(number for _, number in named)
    views = tuple(KnownView(f"{kind}{n}", ViewOffset(0.0, float(n)), PictureSource(named[kind, n])) for n in numbers)
    known = {numbers.index(n): disparity for n, disparity in maps.items() if n in numbers}
    return place_on_grid(MultiView(folder.resolve().name, layout, views, known), [(0, n) for n in numbers])


def _coded_maps(folder: Path, kind: str, picture: Path) -> dict[int, KnownDisparity]:
    """Return maps of integers: disparity between the two views of TRUTH_AT, times a factor that depends on the size."""
    maps, width = maps_in(folder), read_size(picture).width
    is_of_2001 = picture.suffix.lower() == ".ppm" and kind == "im" and width < MAX_WIDTH_2001
    factor = SCALE_2001 if is_of_2001 else float(max(round(FULL_WIDTH[kind] / width), 1))
    known: dict[int, KnownDisparity] = {}
    for n in TRUTH_AT[kind]:
        if path := maps.get(f"disp{n}"):
            scale = 1 / factor if path.suffix.lower() in QUANTIZED else 1.0
            known[n] = KnownDisparity(path, scale / STEPS_BETWEEN_TRUTHS)
    return known
