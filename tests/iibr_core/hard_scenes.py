"""A light field and a photo that are hard in every way at once. What they show is known in closed form.

Field: 3 x 4 views (an even grid) whose rows stand half as far apart as columns, as OpenEXR, turned, in Display P3 and
brighter than white; cameras state infinity; a map of half the size, with a scale, states disparity.

Photo: a turned TIFF in Display P3 with Exif, XMP and position, whose views are half as large; its map states metres.
"""

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray
from PIL import Image

from iibr_core.color import convert, linear_from_srgb, srgb_from_linear
from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.images.color_profile import PRIMARIES, icc_profile
from iibr_core.scenes.scene import Source
from iibr_core.types import DISPLAY_P3, SRGB, GridShape, ImageSize, ViewOffset
from tests.iibr_core.embedded_files import packet

SIZE = ImageSize(32, 48)
GRID, ROW_STEP = GridShape(3, 4), 0.5
NEAR_PX, FAR_PX, INFINITY_PX, FIELD_FOCAL_PX = 2, -2, -3.0, 60.0
"""Disparity of the square and the wall of the field in px per column, and of infinitely far points."""
NEAR_M, FAR_M = 2.0, 8.0
"""Distances of the square and the wall of the photo."""
PHOTO_FOCAL_PX = 35 / np.hypot(36, 24) * np.hypot(*SIZE)
SQUARE = np.s_[8:20, 28:40]
"""The square, right of the middle and above it."""
TURNED = 6
"""Exif's orientation of pictures that are stored lying on their left side."""
MARGIN = 8


def blocks(seed: int, height: int, width: int) -> NDArray[np.float64]:
    """Return noise (height, width, 3) of 0.25 to 0.75 in blocks of 4 pixels."""
    noise = np.random.default_rng(seed).uniform(0.25, 0.75, (-(-height // 4), -(-width // 4), 3))
    return noise.repeat(4, 0).repeat(4, 1)[:height, :width]


def field_light(row: int, column: int) -> NDArray[np.float32]:
    """Return the light (H, W, 3) of a view of the field in Display P3; the square exceeds white."""
    t, s = ROW_STEP * (row - 1), column - 2
    y, x = (side + MARGIN for side in np.indices(SIZE))
    wall, square = (linear_from_srgb(blocks(k, SIZE.height + 2 * MARGIN, SIZE.width + 2 * MARGIN)) for k in (1, 2))
    down, across = (round(FAR_PX * t), round(FAR_PX * s))
    light = wall[y + down, x + across] * np.float32([0.5, 0.8, 1.2])
    moved = SQUARE[0].start - round(NEAR_PX * t), SQUARE[1].start - round(NEAR_PX * s)
    here = np.s_[moved[0] : moved[0] + 12, moved[1] : moved[1] + 12]
    light[here] = (square * np.float32([3.5, 2.0, 1.0]))[SQUARE]
    return light


def field_view(row: int, column: int) -> NDArray[np.float32]:
    """Return the colours (H, W, 3) of a view of the field as sRGB."""
    return convert(srgb_from_linear(field_light(row, column)), SRGB, DISPLAY_P3)


def flat_map(near: float, far: float) -> NDArray[np.float32]:
    """Return a map (H, W) of the square before the wall."""
    values = np.full(SIZE, far, np.float32)
    values[SQUARE] = near
    return values


def lying(upright: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return a picture (H, W, ...) as a camera stores it that TURNED turns upright."""
    return np.ascontiguousarray(np.rot90(upright))


def write_hard_field(folder: Path) -> Source:
    """Write the pictures, transforms.json by the axes of the stored pictures, and the map."""
    (folder / "images").mkdir(parents=True)
    frames = []
    for row, column in np.ndindex(*GRID):
        at, name = ViewOffset(ROW_STEP * (row - 1), column - 2), f"{row}{column}.exr"
        _write_exr(folder / "images" / name, lying(field_light(row, column)))
        # To the right as stored is down as shown, and up as stored is to the right as shown.
        matrix = [[1, 0, 0, 0.3 * at.t], [0, 1, 0, 0.3 * at.s], [0, 0, 1, 0], [0, 0, 0, 1]]
        cx, cy = SIZE.height / 2 - INFINITY_PX * at.t, SIZE.width / 2 + INFINITY_PX * at.s
        frames.append({"file_path": f"images/{name}", "transform_matrix": matrix, "cx": cx, "cy": cy})
    lens = {"w": SIZE.height, "h": SIZE.width, "fl_x": FIELD_FOCAL_PX, "fl_y": FIELD_FOCAL_PX}
    (folder / "transforms.json").write_text(json.dumps({**lens, "frames": frames}))
    given, scale = folder.with_name("given.npy"), 2.0
    np.save(given, flat_map(NEAR_PX, FAR_PX)[::2, ::2] / (2 * scale))
    return Source(str(folder), DepthChoice(file=str(given), file_scale=scale))


def _write_exr(path: Path, light: NDArray[np.generic]) -> None:
    spec = oiio.ImageSpec(light.shape[1], light.shape[0], 3, "float")
    spec.attribute("Orientation", TURNED)
    spec.attribute("chromaticities", "float[8]", PRIMARIES[12][1])
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    assert target.write_image(np.ascontiguousarray(light, np.float32))
    target.close()


def photo_colors() -> NDArray[np.uint8]:
    """Return the photo (2 H, 2 W, 3), upright, in Display P3: each pixel of a view is four alike ones."""
    colors = blocks(1, *SIZE) * (0.5, 0.8, 1.2)
    colors[SQUARE] = (blocks(2, *SIZE) * (1.3, 0.6, 0.3))[SQUARE]
    return np.rint(255 * colors).astype(np.uint8).repeat(2, 0).repeat(2, 1)


def photo_view() -> NDArray[np.float32]:
    """Return the middle view of the photo as sRGB."""
    return convert(photo_colors()[::2, ::2] / np.float32(255), SRGB, DISPLAY_P3)


def write_hard_photo(folder: Path, name: str = "photo.tif") -> Source:
    """Write the photo and the map of distances beside it; open it with 2 x 4 views."""
    exif, gps = 0x8769, 0x8825
    title = "<n0:title><rdf:Alt><rdf:li>A &lt;b&gt;wall&lt;/b&gt;</rdf:li></rdf:Alt></n0:title>"
    tags = {0x0112: TURNED, 0x010E: "Far <b>away</b>", 0x013B: 'Ann "A"', 0x8298: "(c) <Ann>"}
    tags[exif] = {0xA405: 35, 0xA002: 2 * SIZE.height, 0x829A: 0.008}
    tags[gps] = {1: "N", 2: (48.0, 51.0, 24.0)}
    tags[700] = packet({"http://purl.org/dc/elements/1.1/ source": "x"}, title)
    picture = Image.fromarray(lying(photo_colors()))
    picture.save(folder / name, tiffinfo=tags, icc_profile=icc_profile(DISPLAY_P3))
    np.save(folder / f"{Path(name).stem}_depth.npy", flat_map(NEAR_M, FAR_M))
    depth = DepthChoice(is_metric=True, refine=False)
    return Source(str(folder / name), depth, GridShape(2, 4), max_pixels=SIZE.height * SIZE.width)
