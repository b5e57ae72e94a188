"""Depth from a map's file, for a photo: which way up it lies, what its numbers mean, and which end of them is near."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.near_end import is_better_turned, near_evidence, zeros_are_depth
from iibr_core.formats.images.decode import read_orientation
from iibr_core.formats.images.picture import upright
from iibr_core.formats.images.rgbd import rgbd_parts
from iibr_core.formats.maps.disparity_file import has_shape_of, require_scale, resampling_note, scaled_disparity
from iibr_core.formats.maps.reader import MapFile, read_depth_channel, read_map_file, read_map_picture
from iibr_core.formats.maps.writer import MapText
from iibr_core.types import (
    FloatImage,
    InputError,
    Photo,
    image_size,
)

DISTANCE_SHARE = 0.5
"""Integers beyond this share of the greatest one are no distances: cameras see less than 32 m, in millimetres."""
UNIT_RANGE = (0.98, 1.0)
"""Floats that end here were spread from 0 to 1: no distances."""
MILLIMETRES = 0.001
"""Metres in a step of an integer map of distances, as depth cameras write them."""
SURE_AGAINST_CONFIG = 2.0
"""Evidence from which the photo is believed rather than a model's config.json."""
BLACK_IS_NEAR = -1.0
"""This scale says which end of a map of integers is near, and nothing of how much."""


@dataclass(frozen=True, eq=False)
class DepthFromFile:
    """What a map's file says of a photo's depth.

    near: which end is near, for people: "white" or "black" in pictures, else "the high end" or "the low end". notes:
    what was done to the map, and what to do if that was wrong.
    """

    estimate: DepthEstimate
    near: str
    notes: tuple[str, ...]


def depth_from_file(path: Path, photo: Photo, choice: DepthChoice, photo_path: Path | None = None) -> DepthFromFile:
    """Read a map for a photo; the estimate has the map's own size and NaN where nothing is known.

    photo_path: the photo's file, whose Exif may say that the map beside it is to be turned with it. Raises InputError
    where the map cannot be read or has another shape than the photo, and `choice` does not say that it is stretched.
    """
    path = Path(path)
    found = read_map_file(path)
    found = _brought_upright(path, found, photo, photo_path)
    found = _stretched(path, found, photo, choice.stretches)
    found = _with_zeros_told(found)
    estimate, near, notes = _meaning(path, found, photo, choice)
    notes = (*found.notes, *resampling_note(path.name, found.values, photo.size), *notes)
    return DepthFromFile(estimate, near, notes)


def depth_from_channel(path: Path, photo: Photo, choice: DepthChoice) -> DepthFromFile | None:
    """The depth channel of the picture itself, where it is an EXR that has one; see `depth_from_file`."""
    values = read_depth_channel(path)
    return None if values is None else _within(path, MapFile(values, "floats"), photo, choice, are_distances=True)


def depth_beside_picture(path: Path, photo: Photo, choice: DepthChoice) -> DepthFromFile | None:
    """The map that is the other half of a picture's file, where it is a pair of both; see `depth_from_file`."""
    parts = rgbd_parts(path)
    if parts is None:
        return None
    found = _with_zeros_told(read_map_picture(parts[1]))
    return _within(path, found, photo, choice, are_distances=choice.is_metric)


def depth_of_picture(path: Path, values: FloatImage, photo: Photo, choice: DepthChoice) -> DepthFromFile:
    """The meaning of a map (H, W), 0..1, that lies in a photo's file without any description; see `depth_from_file`."""
    return _within(path, MapFile(values, "integers", 1.0), photo, choice, are_distances=choice.is_metric)


def depth_of_model(
    title: str, estimate: DepthEstimate, is_meaning_known: bool, photo: Photo, choice: DepthChoice
) -> DepthFromFile:
    """Return what a model's estimate means; nothing is said (near is "") of published models and disparity.

    Files of one's own say it in a config.json or not at all: where the photo shows the contrary, it decides.
    """
    if estimate.meaning == "disparity" or is_meaning_known:
        return DepthFromFile(estimate, "", ())
    evidence, says_metres = near_evidence(photo.pixels, estimate.values), estimate.is_metric
    if choice.is_metric:
        large_is_near, reason = False, "as said"
    elif says_metres:
        large_is_near = evidence >= SURE_AGAINST_CONFIG
        reason = (
            "as the photo shows, though its config.json says metres" if large_is_near else "as its config.json says"
        )
    else:
        large_is_near = evidence >= -1
        shown = "as the photo shows" if abs(evidence) > 1 else "as usual"
        reason = f"{shown}; --metric if they are distances, --invert-depth if that is wrong"
    near = "the high end" if large_is_near != choice.inverts else "the low end"
    note = f"Large values of {title} count as {'near' if large_is_near else 'far'}, {reason}."
    return DepthFromFile(turned_estimate(estimate, large_is_near, choice), near, (note,))


def turned_estimate(estimate: DepthEstimate, large_is_near: bool, choice: DepthChoice) -> DepthEstimate:
    """Return a model's values with this end near. Those that are far where large count as distances where that was
    said, or all are above 0.
    """
    values = estimate.values
    if large_is_near:
        return DepthEstimate(values, "inverse depth")
    are_metres = choice.is_metric or estimate.is_metric
    are_distances = are_metres or bool((values[np.isfinite(values)] > 0).all())
    return DepthEstimate(values, "metres") if are_distances else DepthEstimate(-values, "inverse depth")


def _within(path: Path, found: MapFile, photo: Photo, choice: DepthChoice, are_distances: bool) -> DepthFromFile:
    estimate, near, notes = _by_evidence(path, found, photo, choice, are_distances)
    return DepthFromFile(estimate, near, (*found.notes, *notes))


def _brought_upright(path: Path, found: MapFile, photo: Photo, photo_path: Path | None) -> MapFile:
    """The map turned as the photo was, where it lies like the photo's stored pixels."""
    turns = 1 if photo_path is None else read_orientation(photo_path)
    if turns == 1:
        return found
    turned = upright(found.values, turns)
    fits, fits_turned = (has_shape_of(image_size(values), photo.size) for values in (found.values, turned))
    if not fits_turned or (fits and not is_better_turned(photo.pixels, found.values, turned)):
        return found
    is_zero = None if found.is_zero is None else upright(found.is_zero, turns)
    note = f"{path.name} was turned like the photo, whose Exif says so."
    return replace(found, values=turned, is_zero=is_zero, notes=(*found.notes, note))


def _stretched(path: Path, found: MapFile, photo: Photo, stretches: bool) -> MapFile:
    """The map with a note where its shape is not the photo's. Raises InputError where that is not wanted."""
    own, size = image_size(found.values), photo.size
    if has_shape_of(own, size):
        return found
    if not stretches:
        raise InputError(
            f"{path}: {own} differs in shape from the photo, {size}; add --stretch if it shows the whole photo,"
            " else crop or rotate it to match"
        )
    return replace(found, notes=(*found.notes, f"{path.name}, {own}, was stretched to the photo's shape."))


def _with_zeros_told(found: MapFile) -> MapFile:
    """The map with NaN for zeros that mean unknown."""
    if found.is_zero is None or zeros_are_depth(found.values, found.is_zero):
        return found
    return replace(found, values=np.where(found.is_zero, np.float32(np.nan), found.values))


def _meaning(
    path: Path, found: MapFile, photo: Photo, choice: DepthChoice
) -> tuple[DepthEstimate, str, tuple[str, ...]]:
    """The estimate, which end of it is near, and what is to be said."""
    if found.text is not None:
        return _as_written(found.text, found.values, choice)
    is_depth = path.stem.endswith("_depth") or choice.is_metric
    is_scaled = choice.file_scale is not None and not (found.numbers != "floats" and choice.file_scale == BLACK_IS_NEAR)
    if not is_depth and (found.numbers == "floats" or is_scaled):
        return _disparity(path, found.values, photo, choice)
    # Distances by their name, unless they were spread over a range, as pictures are.
    are_distances = choice.is_metric or (path.stem.endswith("_depth") and not _is_spread(found))
    return _by_evidence(path, found, photo, choice, are_distances)


def _as_written(text: MapText, values: FloatImage, choice: DepthChoice) -> tuple[DepthEstimate, str, tuple[str, ...]]:
    if text.meaning == "disparity":
        return DepthEstimate(values * np.float32(require_scale(choice.file_scale)), "disparity"), "the high end", ()
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / values
    if text.inverse is None:
        return DepthEstimate(values, "metres"), "the low end", ()
    slope, offset = text.inverse
    return DepthEstimate((slope * inverse + offset).astype(np.float32), "disparity"), "the low end", ()


def _disparity(
    path: Path, values: FloatImage, photo: Photo, choice: DepthChoice
) -> tuple[DepthEstimate, str, tuple[str, ...]]:
    """Disparity that counts as it is; a warning where the photo says that it is the wrong way round."""
    scale = require_scale(choice.file_scale)
    scaled, notes = scaled_disparity(path, values, scale)
    if near_evidence(photo.pixels, scaled) < -1 and not choice.inverts:
        notes += (f"In {path.name} near and far look swapped: turn them with --invert-depth.",)
    return DepthEstimate(scaled, "disparity"), "the high end" if scale > 0 else "the low end", notes


def _by_evidence(
    path: Path, found: MapFile, photo: Photo, choice: DepthChoice, are_distances: bool
) -> tuple[DepthEstimate, str, tuple[str, ...]]:
    """Depth of unknown scale: the photo decides which end is near, and the usual way where it does not."""
    values = found.values
    evidence = near_evidence(photo.pixels, values)
    if choice.file_scale is not None and choice.file_scale < 0:
        large_is_near = False
    else:
        large_is_near = not are_distances if choice.is_metric or abs(evidence) <= 1 else evidence > 0
    if large_is_near:
        estimate = DepthEstimate(values, "inverse depth")
    elif _is_spread(found) and not choice.is_metric:
        estimate = DepthEstimate(-values, "inverse depth")
    else:
        step = MILLIMETRES if found.numbers == "integers" else 1.0
        estimate = DepthEstimate(np.where(values > 0, values * np.float32(step), np.float32(np.nan)), "metres")
    near = _end(found, large_is_near != choice.inverts)
    return estimate, near, (_near_note(path, near, evidence, large_is_near, choice),)


def _is_spread(found: MapFile) -> bool:
    """Whether the values were stretched to a fixed range: 8 bits, a whole range of integers, 0..1, colours."""
    if found.numbers == "colours" or (found.numbers == "integers" and found.largest <= 255):
        return True
    known = found.values[np.isfinite(found.values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    if found.numbers == "integers":
        return high > DISTANCE_SHARE * found.largest
    return low >= 0 and UNIT_RANGE[0] <= high <= UNIT_RANGE[1]


def _end(found: MapFile, large: bool) -> str:
    if found.numbers == "integers" and found.largest in (1, 255, 65535):
        return "white" if large else "black"
    return "the high end" if large else "the low end"


def _near_note(path: Path, near: str, evidence: float, large_is_near: bool, choice: DepthChoice) -> str:
    if choice.inverts:
        return f"In {path.name} {near} counts as near, as asked."
    if choice.is_metric or choice.file_scale is not None:
        doubt = ", though the photo shows otherwise" if evidence * (1 if large_is_near else -1) < -1 else ""
        return f"In {path.name} {near} counts as near, as said{doubt}."
    if abs(evidence) <= 1:
        return f"In {path.name} {near} counts as near, as usual; --invert-depth turns it if that is wrong."
    return f"In {path.name} {near} counts as near, as the photo shows; --invert-depth turns it if that is wrong."
