"""Notes for people about files of which one flat picture is shown: stereo pairs, panoramas, animations, quilts.

A quilt or a mosaic of views without a tag in its name looks like tiles of one scene.
"""

from pathlib import Path

import numpy as np

from iibr_core.formats.images.open_picture import read_metadata
from iibr_core.formats.images.side_by_side import stated_pair
from iibr_core.formats.images.xmp import parse_packet, value_in
from iibr_core.types import FloatImage, InputError

GPANO = "http://ns.google.com/photos/1.0/panorama/"
GIMAGE = "http://ns.google.com/photos/1.0/image/"
GDEPTH = "http://ns.google.com/photos/1.0/depthmap/"
LONGEST_PX = 512
"""Longer side of the copy that is looked at, about."""
MAX_TILES = 20
"""Largest number of tiles along an axis."""
MIN_ALIKE, MIN_JUMP = 1.4, 1.5
"""Factors by which pixels half a tile apart differ more than those a whole tile apart, and neighbours across borders of
tiles more than other neighbours.
"""
MIN_STRIP, MIN_TILE_PX = 4, 8
"""Fewest tiles of a single row or column, and the smallest side of a tile in the copy."""


def file_notes(path: Path) -> tuple[str, ...]:
    """Return a sentence for each thing in a photo's file that is shown in part, or not as it was meant.

    A damaged header gives no notes.
    """
    _, note = stated_pair(path)
    metadata = read_metadata(path)
    animation = f"Animation: the first of its {metadata.pictures} pictures is used." if metadata.pictures > 1 else ""
    return (*filter(None, [note]), *_panorama_notes(metadata.xmp), *filter(None, [animation]))


def _panorama_notes(xmp: bytes) -> tuple[str, ...]:
    """Return notes from XMP as Google's cameras write it for panoramas and photos with a right eye's picture."""
    if GPANO.encode() not in xmp and GIMAGE.encode() not in xmp:
        return ()
    try:
        tree = parse_packet(xmp)
    except InputError:
        return ()
    notes: tuple[str, ...] = ()
    projection = value_in(tree, GPANO, "ProjectionType")
    if projection is not None or value_in(tree, GPANO, "FullPanoWidthPixels") is not None:
        kind = f" ({projection.strip()})" if projection and projection.strip().isalpha() else ""
        notes += (f"Panorama{kind}: shown flat, as if it were an ordinary photo, so straight lines look bent.",)
    # Photos with a depth map hold the picture before it was blurred.
    if value_in(tree, GIMAGE, "Mime") is not None and GDEPTH.encode() not in xmp:
        notes += ("The right eye's picture in it (Cardboard Camera, VR180) is not used.",)
    return notes


def tile_note(pixels: FloatImage) -> tuple[str, ...]:
    """Return a sentence if a photo (H, W, 3) looks like tiles of one scene, none otherwise."""
    step = max(max(pixels.shape[:2]) // LONGEST_PX, 1)
    luma = np.nan_to_num(pixels[::step, ::step].mean(axis=2))
    across, down = _tiles_along(luma.T), _tiles_along(luma)
    if max(across, down) < MIN_STRIP and min(across, down) < 2:
        return ()
    return (
        f"Looks like {across}x{down} pictures of one scene: if it is a quilt or a mosaic of views, let its name end in"
        f" _qs{across}x{down}.",
    )


def _tiles_along(luma: FloatImage) -> int:
    """Return the number of tiles along the first axis of a luma (H, W), 1 if there are none."""
    length = len(luma)
    if length < 2 * MIN_TILE_PX:
        return 1
    steps = np.abs(np.diff(luma, axis=0)).mean(axis=1)
    mean_step = float(np.median(steps))

    def difference(shift: float) -> float:
        rows = np.rint(np.arange(int(length - shift)) + shift).astype(int).clip(0, length - 1)
        return float(np.abs(luma[rows] - luma[: len(rows)]).mean())

    for count in range(min(MAX_TILES, length // MIN_TILE_PX), 1, -1):
        tile = length / count
        borders = np.rint(np.arange(1, count) * tile).astype(int) - 1
        jumps = np.maximum.reduce([steps[(borders + k).clip(0, length - 2)] for k in (-1, 0, 1)])
        is_cut = np.median(jumps) > MIN_JUMP * mean_step > 0
        if is_cut and difference(tile / 2) > MIN_ALIKE * difference(tile):
            return count
    return 1
