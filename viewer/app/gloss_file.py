"""Reads a gloss from a TOML file; the fields are those of `Gloss`, by name. Import it late: it imports msgspec."""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec

from iibr_core.formats.files import read_text
from iibr_core.gloss.settings import Gloss
from iibr_core.types import InputError
from viewer.model.saved_settings import GLOSS_LIMITS, require_points, require_within, short_reason, unknown_fields

MAX_BYTES = 1_000_000
"""Largest size of a gloss file, in bytes."""


def read_gloss(path: Path) -> Gloss:
    """Return the gloss that a file describes. Raises InputError, naming file and field, if it is damaged."""
    text = read_text(path, MAX_BYTES)
    try:
        whole = tomllib.loads(text)
        for unknown in unknown_fields(whole, msgspec.to_builtins(Gloss())):
            raise ValueError(f"there is no setting {unknown}")
        gloss = msgspec.convert(whole, Gloss)
        require_within(gloss, GLOSS_LIMITS)
        require_points(gloss)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not a gloss file ({short_reason(error)}); correct it") from error
    return gloss
