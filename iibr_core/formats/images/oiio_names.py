"""Names of files as OpenImageIO takes them, which knows UTF-8 only; file systems know bytes."""

from __future__ import annotations

import itertools
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from iibr_core.formats.files import reason_of
from iibr_core.types import InputError

_numbers = itertools.count()


def oiio_name(path: Path) -> str:
    """The path; where it is no UTF-8, a link to it with the same ending, through which the file is read or written.

    Raises InputError where there is no place for a link.
    """
    try:
        str(path).encode()
        return str(path)
    except UnicodeEncodeError:
        pass
    ending = path.suffix if path.suffix.isascii() else ""
    try:
        link = Path(_links().name) / f"{next(_numbers)}{ending}"
        link.symlink_to(path.absolute())
    except OSError as error:
        raise InputError(f"{path}: its name is not UTF-8 ({reason_of(error)}); rename it") from error
    return str(link)


@cache
def _links() -> TemporaryDirectory[str]:
    """The folder of links, which goes when the program ends."""
    return TemporaryDirectory(prefix="iibr-")
