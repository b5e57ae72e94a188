"""Compiled kernels on disk, good for as long as every source file that went into them stays the same.

Numba inlines kernels and constants of other files, but stamps an entry by the kernel's own file only: an edit elsewhere
would go unnoticed. Here the stamp is of that file and of all that it imports from this package, directly or not.
"""

from __future__ import annotations

import hashlib
import inspect
import re
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile

PACKAGE = Path(__file__).resolve().parents[1]
_NAMES = re.compile(rf"\b{PACKAGE.name}(?:\.\w+)*".encode())
_LINE_NUMBER = re.compile(r"-\d+(?=\.py\d+\w*$)")


class KernelCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """Of one kernel: Numba's, but for the stamp, the names of the files, and that a file gone bad is a miss.

    Raises OSError or RuntimeError where the kernel's source cannot be read, or nothing can be written.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        # Without the line on which the kernel begins: its files of old are overwritten when the kernel moves.
        name = _LINE_NUMBER.sub("", self._impl.filename_base)
        stamp = sources_hash(Path(inspect.getfile(function)).resolve())
        self._cache_file = IndexDataCacheFile(self.cache_path, name, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled kernel for a signature; None where there is none, or a damaged one."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # damaged bytes raise whatever they like when they are unpickled
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel, where the disk has room for it."""
        with suppress(OSError):
            super().save_overload(sig, data)


def sources_hash(path: Path) -> str:
    """Of a file and of all files of this package that it imports, directly or not. Raises OSError."""
    found, left = {path}, [path]
    while left:
        more = _read_source(left.pop())[1] - found
        found |= more
        left += more
    digests = "".join(f"{file.name} {_read_source(file)[0]}\n" for file in sorted(found))
    return hashlib.sha256(digests.encode()).hexdigest()


@cache
def _read_source(path: Path) -> tuple[str, frozenset[Path]]:
    """Hash of a file, and every file of this package that it names; a package stands for all files right in it.

    Names in comments are taken for imports: one file too many costs a compilation, one too few gives wrong results.
    """
    text = path.read_bytes()
    places = (PACKAGE.parent.joinpath(*name.decode().split(".")) for name in set(_NAMES.findall(text)))
    return hashlib.sha256(text).hexdigest(), frozenset(file for place in places for file in _files_of(place))


@cache
def _files_of(place: Path) -> tuple[Path, ...]:
    file = place.with_suffix(".py")
    return (file,) if file.is_file() else tuple(place.glob("*.py"))
