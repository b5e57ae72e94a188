"""Depth from a map for a photo: the way up, the meaning of the numbers, and which end of them is near."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.near_end import is_better_turned, near_evidence, zeros_are_depth
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture import upright
from iibr_core.formats.maps.disparity_file import has_shape_of, require_scale, resampling_note, scaled_disparity
from iibr_core.formats.maps.map_names import FOLDER_OF_MAPS, map_name, says_depth
from iibr_core.formats.maps.reader import MapFile, read_map_file
from iibr_core.remedies import FixableError, Remedy
from iibr_core.types import Photo, image_size

SPREAD_SHARES = {"floats": 0.98, "integers": 0.5, "colours": 0.0}
"""Share of the greatest value, 1 for floats, that a map reaches if it was spread over a range: distances end lower.

Depth cameras see less than 32 m, in millimetres of 16 bits.
"""

SURE_AGAINST_FILES = 2.0
"""Evidence of the photo from which it overrules what files state."""


@dataclass(frozen=True, eq=False)
class OrientedDepth:
    """Depth whose near end is known.

    near: that end, for people: "white" or "black" in pictures, else "the high end" or "the low end". notes: changes of
    the map, and advice in case they were wrong.
    """

    estimate: DepthEstimate
    near: str
    notes: tuple[str, ...]


def depth_from_file(path: Path, photo_path: Path, photo: Photo, choice: DepthChoice) -> OrientedDepth:
    """Return the depth of a map's file for a photo, at the map's size, NaN where nothing is known.

    The map is turned like the photo if its edges fit the photo's then. Raises InputError if the map cannot be read, or
    has another shape than the photo and `choice` does not stretch it.
    """
    found = _with_unknown_zeros(read_map_file(path))
    found = _turned_like_photo(path, found, photo, open_picture(photo_path).orientation)
    size, photo_size = image_size(found.values), photo.size
    if has_shape_of(size, photo_size):
        notes = resampling_note(path.name, found.values, photo_size)
    elif choice.stretches:
        notes = (f"{path.name}, {size}, was stretched to the photo's shape, {photo_size}.",)
    else:
        raise FixableError(
            f"{path}: {size} differs in shape from the photo, {photo_size}; crop or rotate it to match", Remedy.STRETCH
        )
    depth = _depth_of_map(path, found, photo, choice)
    return replace(depth, notes=(*found.notes, *notes, *depth.notes))


def orient_map(
    name: str, found: MapFile, photo: Photo, choice: DepthChoice, is_distance: bool, is_stated: bool = False
) -> OrientedDepth:
    """Return the depth of a map of unknown scale: the photo decides which end is near; in doubt, is_distance does.

    name: of the map, in notes. is_distance: whether the values are likely distances. is_stated: whether files beside
    the map state that; the photo must then show the contrary clearly.
    """
    found = _with_unknown_zeros(found)
    is_large_near, is_distance = not is_distance, is_distance or choice.is_metric
    evidence = near_evidence(photo.pixels, found.values)
    reason = "as its files state" if is_stated else "as usual"
    if choice.is_metric or (choice.file_scale is not None and choice.file_scale < 0):
        is_large_near = False
        reason = "as said" + (", though the photo shows otherwise" if evidence > 1 else "")
    elif abs(evidence) > (SURE_AGAINST_FILES if is_stated else 1):
        is_large_near, reason = evidence > 0, "as the photo shows"
    if choice.inverts:
        reason = "as asked"
    elif not reason.startswith("as said"):
        reason += "; invert the depth if that is wrong"
    ends = ("black", "white") if found.numbers == "integers" else ("the low end", "the high end")
    near = ends[is_large_near != choice.inverts]
    note = f"In {name} {near} counts as near, {reason}."
    return OrientedDepth(as_estimate(found, is_large_near, is_distance), near, (note,))


def as_estimate(found: MapFile, is_large_near: bool, is_distance: bool) -> DepthEstimate:
    """Return the depth of a map whose near end is known.

    is_distance: whether far values are distances for certain; else they are, unless they were spread over a range or
    some are negative.
    """
    if is_large_near:
        return DepthEstimate(found.values, "inverse depth")
    if not is_distance and (_is_spread(found) or (found.values < 0).any()):
        return DepthEstimate(-found.values, "inverse depth")
    metres = found.values / np.float32(1000) if found.numbers == "integers" else found.values  # stored: millimetres
    return DepthEstimate(np.where(metres > 0, metres, np.float32(np.nan)), "metres")


def _with_unknown_zeros(found: MapFile) -> MapFile:
    """Return the map with NaN for zeros that mean unknown."""
    if found.is_zero is None or zeros_are_depth(found.values, found.is_zero):
        return replace(found, is_zero=None)
    return replace(found, values=np.where(found.is_zero, np.float32(np.nan), found.values), is_zero=None)


def _turned_like_photo(path: Path, found: MapFile, photo: Photo, orientation: int) -> MapFile:
    """Return the map turned as the photo was, if it lies like the photo's stored pixels."""
    turned = upright(found.values, orientation)
    fits, fits_turned = (has_shape_of(image_size(values), photo.size) for values in (found.values, turned))
    if orientation == 1 or not fits_turned or (fits and not is_better_turned(photo.pixels, found.values, turned)):
        return found
    note = f"{path.name} was turned like the photo, whose Exif says so."
    return replace(found, values=turned, notes=(*found.notes, note))


def _depth_of_map(path: Path, found: MapFile, photo: Photo, choice: DepthChoice) -> OrientedDepth:
    """Return the depth of a map by its header, its name and its kind of numbers."""
    text, is_depth = found.text, _says_depth(path) or choice.is_metric
    if text is not None and text.meaning == "depth":
        estimate = DepthEstimate(found.values, "metres")
        if text.inverse is not None:
            slope, offset = text.inverse
            with np.errstate(divide="ignore", invalid="ignore"):
                estimate = DepthEstimate((slope / found.values + offset).astype(np.float32), "disparity")
        return OrientedDepth(estimate, "the low end", ())
    # A scale of -1 only turns integers: their unit stays unknown.
    is_in_px = found.numbers == "floats" or choice.file_scale not in (None, -1)
    if text is not None or (is_in_px and not is_depth):
        return _disparity(path, found, photo, choice)
    # Distances by their name, unless they were spread over a range, as pictures are.
    return orient_map(path.name, found, photo, choice, is_depth and not _is_spread(found))


def _says_depth(path: Path) -> bool:
    """Return whether a map's name, or else that of its folder, says depth."""
    name = path.stem if map_name(path.stem) is not None else path.absolute().parent.name
    return says_depth(name) and (name == path.stem or FOLDER_OF_MAPS.fullmatch(name) is not None)


def _disparity(path: Path, found: MapFile, photo: Photo, choice: DepthChoice) -> OrientedDepth:
    """Return stored disparity, with a warning if near and far look swapped."""
    scale = require_scale(choice.file_scale)
    scaled, notes = scaled_disparity(path, found.values, scale)
    if not choice.inverts and near_evidence(photo.pixels, scaled) < -1:
        notes += (f"In {path.name} near and far look swapped: invert the depth if that is wrong.",)
    return OrientedDepth(DepthEstimate(scaled, "disparity"), "the high end" if scale > 0 else "the low end", notes)


def _is_spread(found: MapFile) -> bool:
    """Return whether the values were spread over a fixed range: 8 bits, a whole range of integers, 0..1, colours."""
    if found.numbers == "integers" and found.largest <= 255:
        return True
    known, least = found.values[np.isfinite(found.values)], SPREAD_SHARES[found.numbers] * found.largest
    return bool(known.size and known.min() >= 0 and least <= known.max() <= found.largest)
