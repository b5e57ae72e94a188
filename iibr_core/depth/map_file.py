"""Depth from a map for a photo: the way up, the meaning of the numbers, and which end of them is near."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.map_numbers import MapNumbers, numbers_of
from iibr_core.depth.near_end import is_better_turned, near_evidence
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture import upright
from iibr_core.formats.maps.disparity_file import has_shape_of, require_scale, resampling_note, scaled_disparity
from iibr_core.formats.maps.map_names import FOLDER_OF_MAPS, MapName, map_name
from iibr_core.formats.maps.reader import MapFile, read_map_file
from iibr_core.remedies import FixableError, FixableNote, Remedy
from iibr_core.types import Photo, image_size

AS_USUAL = "as usual"
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
    found = read_map_file(path)
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
    name: str,
    numbers: MapNumbers,
    photo: Photo,
    choice: DepthChoice,
    is_distance: bool,
    is_stated: bool = False,
    is_disparity: bool = False,
) -> OrientedDepth:
    """Return the depth of a map of unknown scale: the photo decides which end is near, then the numbers of the map.

    name: of the map, in notes. is_distance: whether the values are likely distances. is_stated: whether files beside
    the map state that; the photo must then show the contrary clearly. is_disparity: whether it is named disparity.
    """
    evidence, is_measured = near_evidence(photo.pixels, numbers.values), numbers.is_measured and not is_disparity
    is_large_near, reason = not is_distance, "as its files state" if is_stated else AS_USUAL
    if choice.is_metric or (choice.file_scale is not None and choice.file_scale < 0):
        is_large_near, is_distance = False, is_distance or choice.is_metric
        reason = "as said" + (", though the photo shows otherwise" if evidence > 1 else "")
    elif abs(evidence) > (SURE_AGAINST_FILES if is_stated or is_measured else 1):
        is_large_near, reason = evidence > 0, "as the photo shows"
    elif not is_stated and (is_measured or abs(numbers.bend_evidence) > 1):
        is_large_near, reason = not is_measured and numbers.bend_evidence < 0, "as its numbers show"
    depth, is_integer = as_estimate(numbers, is_large_near, is_distance), numbers.kind == "integers"
    near = (("black", "white") if is_integer else ("the low end", "the high end"))[is_large_near != choice.inverts]
    unit = f", as distances, {numbers.per_metre:g} a metre" if depth.is_metric and is_integer else ""
    note = f"In {name} {near} counts as near{unit}, {'as asked' if choice.inverts else reason}"
    return OrientedDepth(depth, near, (_with_advice(note),))


def _with_advice(note: str) -> str:
    """Return a note on the near end with what to do if it is wrong, unless the user decided."""
    if note.endswith(AS_USUAL):
        words = "in doubt; if that is wrong, invert the depth, or read it as distances (metric)."
        return FixableNote(f"{note}, {words}", Remedy.INVERT_OR_METRIC)
    if note.endswith(("show", "shows", "state")):
        return FixableNote(f"{note}; invert the depth if that is wrong.", Remedy.INVERT)
    return f"{note}."


def as_estimate(numbers: MapNumbers, is_large_near: bool, is_distance: bool) -> DepthEstimate:
    """Return the depth of a map whose near end is known.

    is_distance: whether far values are distances for certain; else they are, unless they were spread over a range or
    some are negative, or planes show that they are not.
    """
    if is_large_near:
        return DepthEstimate(numbers.values, "inverse depth")
    is_relative = numbers.is_normalised or (numbers.values < 0).any() or numbers.bend_evidence < -1
    if not is_distance and is_relative:
        return DepthEstimate(-numbers.values, "inverse depth")
    return DepthEstimate(numbers.distances, "metres")


def _turned_like_photo(path: Path, found: MapFile, photo: Photo, orientation: int) -> MapFile:
    """Return the map turned as the photo was, if it lies like the photo's stored pixels."""
    turned = upright(found.values, orientation)
    fits, fits_turned = (has_shape_of(image_size(values), photo.size) for values in (found.values, turned))
    if orientation == 1 or not fits_turned or (fits and not is_better_turned(photo.pixels, found.values, turned)):
        return found
    note = f"{path.name} was turned like the photo, whose Exif says so."
    is_zero = None if found.is_zero is None else upright(found.is_zero, orientation)
    return replace(found, values=turned, is_zero=is_zero, notes=(*found.notes, note))


def _depth_of_map(path: Path, found: MapFile, photo: Photo, choice: DepthChoice) -> OrientedDepth:
    """Return the depth of a map by its header, its name and its kind of numbers."""
    text, said = found.text, map_name(found.name) or map_name(path.stem) or _folder_name(path)
    is_depth = choice.is_metric or (said is not None and said.is_depth)
    if text is not None and text.meaning == "depth":
        estimate = DepthEstimate(found.values, "metres")
        if text.inverse is not None:
            slope, offset = text.inverse
            with np.errstate(divide="ignore", invalid="ignore"):
                estimate = DepthEstimate((slope / found.values + offset).astype(np.float32), "disparity")
        return OrientedDepth(estimate, _end_of_values(choice.inverts), ())
    # A scale of -1 only turns integers: their unit stays unknown.
    is_in_px = found.numbers == "floats" or choice.file_scale not in (None, -1)
    is_own = text is not None
    numbers = MapNumbers(found.numbers, found.values, found.values, False) if is_own else numbers_of(found)
    if is_own or (is_in_px and not is_depth):
        return _disparity(path, numbers, photo, choice)
    # Distances by their name, unless they were spread over a range, as pictures are.
    is_distance, is_disparity = is_depth and not numbers.is_normalised, said is not None and not is_depth
    return orient_map(path.name, numbers, photo, choice, is_distance, is_disparity=is_disparity)


def _folder_name(path: Path) -> MapName | None:
    name = path.absolute().parent.name
    return map_name(name) if FOLDER_OF_MAPS.fullmatch(name) else None


def _disparity(path: Path, numbers: MapNumbers, photo: Photo, choice: DepthChoice) -> OrientedDepth:
    """Return stored disparity, with a warning if near and far look swapped."""
    scale = require_scale(choice.file_scale)
    scaled, notes = scaled_disparity(path, numbers.values, scale)
    evidence = near_evidence(photo.pixels, scaled)
    may_be_metric = scale > 0 and bool(np.nanmin(numbers.values) > 0)
    if not choice.inverts and may_be_metric and (evidence < -1 or (evidence < 1 < numbers.bend_evidence)):
        words = "near and far look swapped: read it as distances (metric) if it holds them, else invert the depth."
        notes += (FixableNote(f"In {path.name} {words}", Remedy.INVERT_OR_METRIC),)
    elif not choice.inverts and evidence < -1:
        words = "near and far look swapped: invert the depth if that is wrong."
        notes += (FixableNote(f"In {path.name} {words}", Remedy.INVERT),)
    return OrientedDepth(DepthEstimate(scaled, "disparity"), _end_of_values((scale > 0) != choice.inverts), notes)


def _end_of_values(is_large_near: bool) -> str:
    return "the high end" if is_large_near else "the low end"
