"""A gloss as a TOML file: the fields of `Gloss` by their names, what is left out is as usual.

Whoever needs this module imports it late, as `saved_settings`: msgspec costs the window time before its first frame.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import msgspec

from iibr_core.formats.files import read_text
from iibr_core.formats.images.side_by_side import photo_size
from iibr_core.rendering.gloss.gloss_settings import Gloss, require_sound
from iibr_core.types import InputError
from viewer.model.saved_settings import unknown_fields

MOST_BYTES = 1_000_000


def read_gloss(path: Path) -> Gloss:
    """The gloss that a file describes; its environment's path counts from the file's folder.

    Raises InputError, naming file and field, where it cannot be read or makes no sense.
    """
    text = read_text(path, MOST_BYTES)
    try:
        whole = tomllib.loads(text)
        for unknown in unknown_fields(whole, msgspec.to_builtins(Gloss())):
            raise ValueError(f"it knows no {unknown}")  # a misspelt name would silently be as usual
        gloss = msgspec.convert(whole, Gloss)
        require_sound(gloss)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).removeprefix("gloss: ").split())[:120]
        raise InputError(f"{path}: is no gloss ({reason}); see `iibr generate --help`") from error
    return replace(gloss, environment=str(path.parent / gloss.environment) if gloss.environment else "")


def require_environment(path: Path, gloss: Gloss) -> None:
    """Raise InputError, naming the file that a gloss was read from too, where the environment is no picture."""
    if not gloss.environment:
        return
    try:
        photo_size(Path(gloss.environment))
    except InputError as error:
        raise InputError(f"{path}: its environment cannot be read: {error}") from error
