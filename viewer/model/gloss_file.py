"""A gloss as a TOML file: the fields of `Gloss` by name; missing fields have their defaults.

Import this module late, as `saved_settings`: msgspec costs the window time before its first frame.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec

from iibr_core.formats.files import read_text
from iibr_core.gloss.settings import Gloss
from iibr_core.types import InputError
from viewer.model.gloss_bounds import GlossBounds
from viewer.model.saved_settings import unknown_fields

MAX_BYTES = 1_000_000


def read_gloss(path: Path) -> Gloss:
    """Return the gloss that a file describes. Raises InputError, naming file and field, if it is damaged."""
    text = read_text(path, MAX_BYTES)
    try:
        whole = tomllib.loads(text)
        for unknown in unknown_fields(whole, msgspec.to_builtins(Gloss())):
            raise ValueError(f"there is no setting {unknown}")
        msgspec.convert(whole, GlossBounds)
        return msgspec.convert(whole, Gloss)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).replace("- at `$.", "at `").split())[:120]
        raise InputError(f"{path}: is no gloss ({reason}); correct it") from error
