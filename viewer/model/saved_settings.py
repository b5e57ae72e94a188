"""Settings inside a saved picture, as JSON in its metadata: enough to take the same picture of the same photo again."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
from collections.abc import Collection
from pathlib import Path
from typing import Any, get_args

from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, Stroke, require_sound
from iibr_core.types import GridShape, InputError, Quality, ViewOffset
from viewer.model.lens.limits import is_finite
from viewer.model.state.app_state import APERTURE_KINDS, ApertureMask, ApertureShape, Optics, SavedSettings, Source

ATTRIBUTE = "iibr:settings"
FORMAT = 1
MOST_CHARACTERS = 1_000_000


def settings_text(settings: SavedSettings) -> str:
    """The settings as JSON."""
    optics = dataclasses.asdict(settings.optics)
    shape = optics["aperture_shape"]
    if settings.optics.aperture_shape.mask is not None:
        shape["mask"]["values"] = base64.b64encode(settings.optics.aperture_shape.mask.values).decode("ascii")
    source = dataclasses.asdict(settings.source)
    decided = {name: source[name] for name in _SOURCE_FIELDS}
    whole = {
        "format": FORMAT,
        "optics": optics,
        "depth_strength": settings.depth_strength,
        "source": decided,
        "size_px": settings.size_px,
    }
    if settings.depth_edits != UNEDITED:
        whole["depth_edits"] = dataclasses.asdict(settings.depth_edits)
    return json.dumps(whole, separators=(",", ":"), allow_nan=False)


def settings_from_text(text: str, name: str) -> SavedSettings:
    """The inverse of `settings_text`. name: of the picture, for the message.

    Raises InputError where the text is damaged, of a newer program, or means nothing.
    """
    try:
        whole = json.loads(text if len(text) <= MOST_CHARACTERS else "")
        if whole["format"] != FORMAT:
            raise InputError(f"{name}: its settings have format {whole['format']!r}, this program reads {FORMAT}")
        width, height = (_whole_number(side, 1, 1_000_000) for side in whole["size_px"])
        optics, source = _optics(whole["optics"]), _source(whole["source"])
        edits = _depth_edits(whole.get("depth_edits"))
        settings = SavedSettings(optics, _number(whole["depth_strength"]), source, (width, height), edits)
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        reason = " ".join(str(error).split())[:80]
        raise InputError(
            f"{name}: its settings are damaged or of another program ({reason}); set them by hand"
        ) from error
    return settings


def read_settings(path: Path) -> SavedSettings:
    """The settings a picture was saved with. Raises InputError where there are none, or damaged ones."""
    text = settings_text_in(path)
    if not text:
        raise InputError(f"{path}: holds no settings of iibr; give a picture saved with Ctrl+S or `iibr screenshot`")
    return settings_from_text(text, str(path))


def settings_text_in(path: Path) -> str:
    """The text of the settings in a picture's header, "" without. Raises InputError where it is no picture."""
    import OpenImageIO as oiio

    from iibr_core.formats.images.oiio_reader import complaint_of

    if not path.is_file():
        raise InputError(f"{path}: no such file")
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise InputError(f"{path}: is no picture ({' '.join(complaint_of(oiio).split())[:120] or 'no reason given'})")
    try:
        return str(source.spec().get_string_attribute(ATTRIBUTE))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: its settings are damaged (no text); set them by hand") from error
    finally:
        source.close()


def source_like(source: Source, saved: SavedSettings, given: Collection[str]) -> Source:
    """The source with what was decided for the saved picture, except for the fields named in `given`."""
    taken = {name: getattr(saved.source, name) for name in _SOURCE_FIELDS if name not in given}
    return dataclasses.replace(source, **taken)


_SOURCE_FIELDS = ("disparity_scale", "grid", "focus_disparity", "max_pixels", "memory_bytes", "quality", "refine")


def _optics(fields: dict[str, Any]) -> Optics:
    t, s = (_number(value) for value in fields["eye"])
    right, down = (_number(value) for value in fields["focus_tilt"])
    plain = ("dolly", "focus_disparity", "focus_range", "aperture_diameter", "highlight_recovery", "exposure_stops")
    numbers = {name: _number(fields[name]) for name in plain}
    shape = _shape(fields["aperture_shape"])
    optics = Optics(eye=ViewOffset(t, s), focus_tilt=(right, down), aperture_shape=shape, **numbers)
    if not is_finite(optics):
        raise ValueError("a value is not finite")
    return optics


def _shape(fields: dict[str, Any]) -> ApertureShape:
    if fields["kind"] not in APERTURE_KINDS:
        raise ValueError(f"aperture shape {fields['kind']!r}")
    numbers = {name: _number(fields[name]) for name in ("rotation_deg", "ring_inner", "cat_eye")}
    mask = None if fields["mask"] is None else _mask(fields["mask"])
    return ApertureShape(fields["kind"], _whole_number(fields["blades"], 3, 11), mask=mask, **numbers)


def _mask(fields: dict[str, Any]) -> ApertureMask:
    rows, columns = (_whole_number(fields[name], 1, 4096) for name in ("rows", "columns"))
    values = base64.b64decode(fields["values"], validate=True)
    if len(values) != rows * columns or not any(values):
        raise ValueError("aperture mask is empty or of another size")
    return ApertureMask(str(fields["name"]), rows, columns, values)


def _source(fields: dict[str, Any]) -> Source:
    def some(name: str) -> Any:
        return fields.get(name)

    grid = None if some("grid") is None else GridShape(*(_whole_number(n, 1, 99) for n in fields["grid"]))
    focus = None if some("focus_disparity") is None else _number(fields["focus_disparity"])
    most, memory = (None if some(n) is None else _whole_number(fields[n], 1, 2**62) for n in _SOURCE_FIELDS[3:5])
    quality = fields["quality"]
    if quality not in get_args(Quality):
        raise ValueError(f"quality {quality!r}")
    scale, refine = _number(fields["disparity_scale"]), _number(fields.get("refine", 1.0))
    return Source("", None, scale, grid, focus, most, memory, quality, refine=refine)


def _depth_edits(fields: dict[str, Any] | None) -> DepthEdits:
    """Raises InputError where they make no sense."""
    if fields is None:
        return UNEDITED
    strokes = tuple(
        Stroke(
            stroke["tool"],
            tuple((_number(x), _number(y)) for x, y in stroke["points"]),
            _number(stroke["radius"]),
            _number(stroke["strength"]),
        )
        for stroke in fields["strokes"]
    )
    numbers = {name: _number(fields[name]) for name in ("far_clip", "near_clip", "gamma")}
    edits = DepthEdits(bool(fields["is_inverted"]), strokes=strokes, **numbers)
    require_sound(edits)
    return edits


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{value!r} is no number")
    return float(value)


def _whole_number(value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"{value!r} is not from {low} to {high}")
    return value
