"""Compile the hot loops with Numba, and keep what was compiled.

An installation brings its kernels compiled, in `iibr_core/_kernels` (`viewer/precompile.py`). They count where Numba,
Python, the kind of processor and the sources are the same. The stamp of a kernel is a hash of its file and of all files
of this package that this one imports: Numba inlines kernels and constants of other files, but does not see their edits.
"""

from __future__ import annotations

import atexit
import hashlib
import inspect
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding
from platformdirs import user_cache_path

from iibr_core.runtime.compiling import FOLDER_VARIABLE, compiled, report_compiling

PACKAGE = Path(__file__).resolve().parents[1]
SHIPPED = PACKAGE / "_kernels"
IMPORT = re.compile(rb"(?:from|import) (iibr_core(?:\.\w+)*)")
KERNELS_OF_A_PHOTO = 105
"""About the number of compiled kernels that a photo with a map needs."""
PROCESSOR = "x86-64-v3"
PROCESSOR_FEATURES = ("avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sahf", "sse4.2")
"""Level 3 of the x86-64 psABI, in LLVM's names: nearly every such processor since 2015."""


def _set_up_numba() -> None:
    """Choose the place of compiled kernels, and one kind of processor, so that kernels compiled elsewhere count here.

    What the user has set in the environment stays.
    """
    numbas = ("UserProvidedCacheLocator", "InTreeCacheLocator", "UserWideCacheLocator", "IPythonCacheLocator")
    os.environ.setdefault("NUMBA_CACHE_LOCATOR_CLASSES", ",".join((f"{__name__}.KernelLocator", *numbas)))
    os.environ.setdefault("NUMBA_DISABLE_INTEL_SVML", "1")  # a library that not every machine has
    found = llvmlite.binding.get_host_cpu_features()
    if all(found.get(name) for name in PROCESSOR_FEATURES) and "NUMBA_CPU_FEATURES" not in os.environ:
        os.environ.setdefault("NUMBA_CPU_NAME", PROCESSOR)
        os.environ["NUMBA_CPU_FEATURES"] = ""


_set_up_numba()

import numba  # noqa: E402  it reads the environment once
from numba.core import event  # noqa: E402

numba.core.config.reload_config()  # where another library has imported it before


class _CompilingListener(event.Listener):  # type: ignore[misc]  # Numba has no types
    """Report that a kernel has to be compiled, and count it. Numba compiles in one thread at a time; calls nest."""

    def __init__(self) -> None:
        self._begun_s: list[float] = []

    def on_start(self, event: Any) -> None:
        if not compiled.count:
            compiled.expected = max(KERNELS_OF_A_PHOTO - kernel_count(), 0)
        self._begun_s.append(time.perf_counter())
        report_compiling()

    def on_end(self, event: Any) -> None:
        begun_s = self._begun_s.pop()
        compiled.count += event.data["dispatcher"].py_func.__module__.startswith("iibr_core.")
        compiled.seconds += 0.0 if self._begun_s else time.perf_counter() - begun_s


event.register("numba:compile", _CompilingListener())

# Reassociation and contraction only: NaN and infinity keep their meaning.
kernel: Callable[[Callable[..., Any]], Any] = numba.njit(
    nogil=True, cache=True, error_model="numpy", fastmath={"reassoc", "contract", "arcp", "nsz"}
)
"""The only decorator for hot loops: compiled at the first call, or read from where it was kept; threads run it side by
side. A kernel that calls another with arrays pays for counting references, per call: inner loops pass scalars only.
"""


class KernelLocator:
    """Place of a compiled kernel, and its stamp: the public hook of Numba 0.68."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._file = _resolve(inspect.getfile(function))
        self._folder = kernel_folder().joinpath(*self._file.parent.relative_to(PACKAGE).parts)

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> KernelLocator | None:
        """Return the locator of one function, None for those of other packages."""
        return cls(function) if _resolve(file).is_relative_to(PACKAGE) else None

    def get_cache_path(self) -> str:
        """Return the folder of the files of this kernel."""
        return str(self._folder)

    def ensure_cache_path(self) -> None:
        """Make that folder. Raises OSError."""
        self._folder.mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Return the hash of all sources that the kernel may be made of."""
        return sources_hash(self._file)

    def get_disambiguator(self) -> str:
        """Return an addition to the file's name: kernels of other sources may name records that no longer exist."""
        return sources_hash(self._file)[:16]


@cache
def kernel_folder() -> Path:
    """Return the folder with all compiled kernels: the installation's own where that can be written to.

    Else it is one in the user's cache, or without that one for this run; it begins as a copy of the installation's.
    """
    if FOLDER_VARIABLE in os.environ:
        return Path(os.environ[FOLDER_VARIABLE]).absolute()
    if os.access(SHIPPED if SHIPPED.is_dir() else PACKAGE, os.W_OK):
        return SHIPPED
    shipped = f"{PACKAGE} {SHIPPED.stat().st_mtime_ns if SHIPPED.is_dir() else 0}"
    folder = user_cache_path("iibr", appauthor=False) / "kernels" / hashlib.sha256(shipped.encode()).hexdigest()[:16]
    try:
        _copy_kernels(folder)
    except OSError:
        scratch = tempfile.TemporaryDirectory(prefix="iibr-kernels-")
        atexit.register(scratch.cleanup)
        folder = Path(scratch.name) / "kernels"
        _copy_kernels(folder)
    return folder


def kernel_count() -> int:
    """Return the number of compiled kernels that are kept."""
    return sum(1 for _ in kernel_folder().rglob("*.nbc"))


def _copy_kernels(target: Path) -> None:
    """Make a folder with the installation's kernels, if there is none, as a whole or not at all. Raises OSError."""
    if target.is_dir():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as scratch:
        unfinished = Path(scratch) / "kernels"
        unfinished.mkdir()
        for file in SHIPPED.rglob("*.nb?"):
            copy = unfinished / file.relative_to(SHIPPED)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, copy)
        try:
            unfinished.rename(target)
        except OSError:  # another process may have made it at the same time
            if not target.is_dir():
                raise


@cache
def _resolve(file: str) -> Path:
    """Return the absolute path of a file of sources, which holds many kernels."""
    return Path(file).resolve()


@cache
def sources_hash(path: Path) -> str:
    """Return the hash of a file and of all files of this package that it imports, directly or not. Raises OSError."""
    found, left = {path}, [path]
    while left:
        more = _read_source(left.pop())[1] - found
        found |= more
        left += more
    digests = "".join(f"{file.name} {_read_source(file)[0]}\n" for file in sorted(found))
    return hashlib.sha256(digests.encode()).hexdigest()


@cache
def _read_source(path: Path) -> tuple[str, frozenset[Path]]:
    """Return the hash of a file, and the files of this package that it imports; a package means all files in it."""
    text = path.read_bytes()
    places = (PACKAGE.parent.joinpath(*name.decode().split(".")) for name in set(IMPORT.findall(text)))
    return hashlib.sha256(text).hexdigest(), frozenset(file for place in places for file in _files_of(place))


@cache
def _files_of(place: Path) -> tuple[Path, ...]:
    file = place.with_suffix(".py")
    return (file,) if file.is_file() else tuple(place.glob("*.py"))
