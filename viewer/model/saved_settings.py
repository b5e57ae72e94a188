"""Settings inside a saved picture, as JSON in its metadata: enough to take the same picture of the same photo again.

Anybody may have written such a text, so it names no files.

Import this module late: msgspec takes 10 to 40 ms, which the window's first frame need not wait for.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, require_sound
from iibr_core.formats.files import printable
from iibr_core.gloss.settings import (
    LIGHT_RADIUS_LIMITS_DEG,
    MAX_STROKE_POINTS,
    MAX_TOLERANCE,
    STROKE_RADIUS_LIMITS,
    Gloss,
)
from iibr_core.scenes.lens_limits import BLADES_LIMITS
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, InputError
from viewer.model.saving import SavedSettings

FORMAT = 1
MAX_CHARACTERS = 16_000_000
"""Largest length of the text; a thousand strokes take 1.3 million."""
Limits = Mapping[str, tuple[float, float]]
"""Smallest and largest value of each number, by its name with dots."""
GLOSS_LIMITS: Limits = {
    "roughness": (0.0, 1.0),
    "reflectance": (0.0, 1.0),
    "surface.farthest": (0.0, 1.0),
    "surface.nearest": (0.0, 1.0),
    "surface.color": (0.0, 1.0),
    "surface.tolerance": (0.0, MAX_TOLERANCE),
    "surface.strokes.points": (-1.0, 2.0),
    "surface.strokes.radius": STROKE_RADIUS_LIMITS,
    "light.direction": (-1e6, 1e6),
    "light.color": (0.0, 100.0),
    "light.radius_deg": LIGHT_RADIUS_LIMITS_DEG,
}
OPTICS_LIMITS = {
    "optics.aperture_shape.blades": BLADES_LIMITS,
    "optics.aperture_shape.mask.rows": (1, 4096),
    "optics.aperture_shape.mask.columns": (1, 4096),
    **{f"optics.gloss.{name}": limits for name, limits in GLOSS_LIMITS.items()},
}
"""Limits of numbers that no lens clamps."""
FORMER_SETTINGS = ("source.max_pixels", "source.memory_bytes", "source.quality")
"""Settings that earlier versions wrote; they are ignored."""
NAMED_FIELDS = 3
"""Largest number of unknown fields that a message names."""

MAX_SIDE_PX, MAX_PIXELS = 16_384, 100_000_000
"""Largest side and largest area of a picture that a file may ask for."""

MAX_STROKES = 10_000
"""Largest number of strokes in a file from elsewhere: as many as days of work."""

SidePx = Annotated[int, msgspec.Meta(ge=1, le=1_000_000)]
Views = Annotated[int, msgspec.Meta(ge=1, le=99)]
Place = Annotated[float, msgspec.Meta(ge=-1, le=1)]


class SourceText(msgspec.Struct, frozen=True, kw_only=True):
    """The fields of a `Source` that a picture keeps: no paths, nothing that belongs to one machine."""

    disparity_scale: float | None = None
    invert_depth: bool = False
    metric: bool = False
    stretch: bool = False
    grid: tuple[Views, Views] | None = None
    focus_disparity: float | None = None
    refine: bool | float = True
    """Earlier versions wrote a strength, 0 to 1."""


class FormatText(msgspec.Struct, frozen=True, kw_only=True):
    """The number of the format: this program reads only its own."""

    format: int


class SettingsText(FormatText, frozen=True, kw_only=True, omit_defaults=True):
    """The whole text, see `SavedSettings`. Fields that later versions add have defaults."""

    optics: Optics
    depth_strength: float
    source: SourceText
    size_px: tuple[SidePx, SidePx]
    depth_edits: DepthEdits = UNEDITED
    has_model_depth: bool = False
    view_width: SidePx | None = None
    focused_at: tuple[Place, Place] | None = None
    depth_model: str = ""


def settings_text(settings: SavedSettings) -> str:
    """Return the settings as JSON."""
    fields: dict[str, Any] = {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
    del fields["unknown_fields"]
    text = SettingsText(**fields | {"format": FORMAT, "source": _text_of_source(settings.source)})
    return msgspec.json.encode(text, enc_hook=lambda number: number.item()).decode()  # numpy's numbers


def settings_from_text(text: str, name: str, is_own: bool = False) -> SavedSettings:
    """Return the settings of a text, the inverse of `settings_text`.

    name: of the picture, for the message. is_own: whether this program wrote it for this user, with any number of
    strokes. Unknown fields are left out and named in the result. Raises InputError, which names the field.
    """
    try:
        whole = msgspec.json.decode(text if len(text) <= MAX_CHARACTERS else "")
        number = msgspec.convert(whole, FormatText).format
        if number != FORMAT:
            raise ValueError(f"format {number}, this program reads {FORMAT}")
        read = msgspec.convert(whole, SettingsText)
        _require_sound(read.optics)
        require_sound(read.depth_edits)
        gloss = read.optics.gloss
        strokes = len(read.depth_edits.strokes) + (len(gloss.surface.strokes) if gloss is not None else 0)
        if not is_own and strokes > MAX_STROKES:
            raise ValueError(f"{strokes:,} strokes, at most {MAX_STROKES:,} are painted")
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{name}: its settings are damaged or of another program ({short_reason(error)}); set them by hand"
        ) from error
    named = dict.fromkeys(unknown_fields(whole, msgspec.to_builtins(read)))
    fields = msgspec.structs.asdict(read) | {
        "source": _source_from_text(Source(""), read.source),
        "size_px": ScreenSize(*read.size_px),
        "unknown_fields": tuple(field for field in named if field not in FORMER_SETTINGS),
    }
    del fields["format"]
    return SavedSettings(**fields)


def require_saved_size(saved: SavedSettings, path: Path) -> None:
    """Raise InputError if the settings ask for a larger picture than this program draws."""
    width, height = saved.size_px
    if max(width, height) > MAX_SIDE_PX or width * height > MAX_PIXELS:
        raise InputError(
            f"{path}: its settings ask for a picture of {width}x{height} px, which is too large; give a smaller size"
        )


def source_like(source: Source, saved: SavedSettings, given: Collection[str]) -> Source:
    """Return the source with the decisions of a saved picture, except for the fields of `SourceText` in `given`."""
    decided = msgspec.structs.asdict(_text_of_source(saved.source))
    taken = {name: value for name, value in decided.items() if name not in given}
    return _source_from_text(source, msgspec.structs.replace(_text_of_source(source), **taken))


def left_out_note(settings: SavedSettings) -> str:
    """Return a message that names the fields that were left out, "" if there are none."""
    names = settings.unknown_fields
    if not names:
        return ""
    more = f" and {len(names) - NAMED_FIELDS} more" if len(names) > NAMED_FIELDS else ""
    return f"Settings that this version does not know are left out: {', '.join(names[:NAMED_FIELDS])}{more}."


def _text_of_source(source: Source) -> SourceText:
    return SourceText(
        disparity_scale=source.depth.file_scale,
        invert_depth=source.depth.inverts,
        metric=source.depth.is_metric,
        stretch=source.depth.stretches,
        grid=source.grid,
        focus_disparity=source.focus_disparity,
        refine=source.depth.refine,
    )


def _source_from_text(source: Source, text: SourceText) -> Source:
    """Return the source with the fields of a text; its paths and the search for depth stay."""
    return dataclasses.replace(
        source,
        depth=dataclasses.replace(
            source.depth,
            file_scale=text.disparity_scale,
            inverts=text.invert_depth,
            is_metric=text.metric,
            stretches=text.stretch,
            refine=bool(text.refine),
        ),
        grid=None if text.grid is None else GridShape(*text.grid),
        focus_disparity=text.focus_disparity,
    )


def _require_sound(optics: Optics) -> None:
    """Raise ValueError for numbers out of range, and for a mask that is empty or of another size."""
    require_within({"optics": optics}, OPTICS_LIMITS)
    mask = optics.aperture_shape.mask
    if mask is not None and (len(mask.values) != mask.rows * mask.columns or not any(mask.values)):
        raise ValueError("optics.aperture_shape.mask is empty or of another size")
    if optics.gloss is not None:
        require_points(optics.gloss)


def require_within(record: object, limits: Limits) -> None:
    """Raise ValueError, naming the field, if a number of a record or of its parts is out of its limits."""
    for name, value in _numbers_in(msgspec.to_builtins(record)):
        if name in limits and not limits[name][0] <= value <= limits[name][1]:
            raise ValueError("{}: {} is not from {:g} to {:g}".format(name, value, *limits[name]))


def require_points(gloss: Gloss) -> None:
    """Raise ValueError if a stroke has no points or too many."""
    if not all(1 <= len(stroke.points) <= MAX_STROKE_POINTS for stroke in gloss.surface.strokes):
        raise ValueError(f"surface.strokes: a stroke has 1 to {MAX_STROKE_POINTS:,} points")


def short_reason(error: Exception) -> str:
    """Return the message of an error in one short line, with the field that msgspec names."""
    return " ".join(str(error).replace("- at `$.", "at `").split())[:120]


def _numbers_in(value: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """Yield all numbers in dictionaries and lists, with their names; the items of a list have the list's name."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _numbers_in(part, f"{name}.{key}".lstrip("."))
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _numbers_in(part, name)
    elif isinstance(value, int | float):
        yield name, value


def unknown_fields(raw: Any, known: Any, within: str = "") -> Iterator[str]:
    """Yield the names, with dots, of fields that are in the text but not in what was read from it.

    Fields that are false or "" are skipped: earlier versions wrote them for absent values.
    """
    if isinstance(raw, dict) and isinstance(known, dict):
        for name, value in raw.items():
            if name in known:
                yield from unknown_fields(value, known[name], f"{within}{name}.")
            elif value is not False and value != "":
                yield within + printable(" ".join(name.split())[:40])
    elif isinstance(raw, list) and isinstance(known, list | tuple):
        for value, known_value in zip(raw, known):
            yield from unknown_fields(value, known_value, within)
