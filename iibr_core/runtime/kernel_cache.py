"""Compiled kernels on disk, good for as long as every source file that went into them stays the same.

Numba inlines kernels and constants of other files, but stamps an entry by the kernel's own file only: an edit elsewhere
would go unnoticed. Here the stamp is of that file and of all that it imports from this package, directly or not.

An installation brings its kernels along, compiled (`viewer/precompile.py`): they count where the sources, Numba, Python
and the kind of processor are the same, and whoever asks has none of their own. Code is only ever loaded from this
package's own folder and from where Numba keeps what this user compiled.
"""

from __future__ import annotations

import errno
import hashlib
import inspect
import os
import pickle
import re
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from iibr_core.runtime.compiling import note_kernel


@contextmanager
def _as_if_missing(*packages: str) -> Iterator[None]:
    """Whoever imports one of these meanwhile is told that there is none."""
    before = {name: sys.modules[name] for name in packages if name in sys.modules}
    sys.modules.update(dict.fromkeys(packages))  # type: ignore[arg-type]  # how Python says so
    try:
        yield
    finally:
        for name in packages:
            del sys.modules[name]
        sys.modules.update(before)


def _import_numba() -> Any:
    """Numba, without the settings that it takes from `.numba_config.yaml` in the working folder: they name the folder
    where compiled code is kept, and what lies there is run. And without scipy, where that is installed: matrices are
    none of our kernels' business, and it would cost each start 0.2 s.
    """
    with _as_if_missing("yaml", "scipy"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "A Numba config file is found")
        import numba
        import numba.np.arraymath  # the part that looks for scipy, else at the first kernel
    numba.core.config._config_fname = os.devnull  # it looks again whenever it compiles
    _choose_processor(numba)
    return numba


PROCESSOR = "x86-64-v3"
PROCESSOR_FEATURES = {"avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sahf", "sse4.2"}
"""Of the x86-64 psABI's level 3, in LLVM's names: nearly every such processor since 2015."""


def _choose_processor(numba: Any) -> None:
    """Compile for PROCESSOR wherever this one is of that kind, so that kernels compiled elsewhere count here, and
    results do not depend on the model. Whoever told Numba otherwise has it so; other processors get code of their own.
    """
    config = numba.core.config
    if config.CPU_NAME is None and config.CPU_FEATURES is None:
        found = {name[1:] for name in numba.core.codegen.get_host_cpu_features().split(",") if name.startswith("+")}
        if found >= PROCESSOR_FEATURES:
            config.CPU_NAME, config.CPU_FEATURES = PROCESSOR, ""


numba = _import_numba()
"""All of the core has it from here."""

PACKAGE = Path(__file__).resolve().parents[1]
PRECOMPILED = PACKAGE / "_kernels"
"""What comes along with an installation: the folders of the package again, with its compiled kernels."""
KNOWN_NUMBA = "0.68."
"""Of these versions it is known how a compiled kernel is kept: see `_Library`."""
_NAMES = re.compile(rf"\b{PACKAGE.name}(?:\.\w+)*".encode())
_LINE_NUMBER = re.compile(r"-\d+(?=\.py\d+\w*$)")


class _Nowhere(numba.core.caching._CacheLocator):  # type: ignore[misc, name-defined]  # numba has no types
    """Stands in where nothing can be written in any place: kernels that come along are read all the same."""

    def get_cache_path(self) -> str:
        return os.devnull

    def ensure_cache_path(self) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    def get_source_stamp(self) -> None:
        pass

    def get_disambiguator(self) -> str:
        return "0"

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Nowhere:
        return cls()


class _Along(_Nowhere):
    """PRECOMPILED itself, while it is filled."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get_cache_path(self) -> str:
        return str(self._folder)

    def ensure_cache_path(self) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Along:
        return cls(_folder_along(py_func))


class _Library(numba.core.codegen.JITCodeLibrary):  # type: ignore[misc, name-defined]
    """A loaded kernel, whose code for inlining is read only once another kernel is compiled that calls it: of the time
    that loading takes, with all other threads waiting, it is the larger part.
    """

    _shared_module: Any
    _bitcode = b""

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = numba.core.codegen.ll.parse_bitcode(self._bitcode)
            self._codegen._engine._load_defined_symbols(self._shared_module)
        return self._shared_module


@cache
def _no_code() -> bytes:
    """An empty module."""
    return bytes(numba.core.codegen.ll.parse_assembly("").as_bitcode())


class _Implementation(numba.core.caching.CompileResultCacheImpl):  # type: ignore[misc, name-defined]
    _locator_classes = (*numba.core.caching.CompileResultCacheImpl._locator_classes, _Nowhere)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """As Numba's, see `_Library`."""
        if not numba.__version__.startswith(KNOWN_NUMBA):
            return super().rebuild(target_context, payload)
        (name, kind, (code, bitcode)), about, *_ = payload
        names = about.llvm_func_name, about.llvm_cpython_wrapper_name, about.llvm_cfunc_wrapper_name
        target_context.codegen()._engine._defined_symbols.update(names)
        kernel = super().rebuild(target_context, ((name, kind, (code, _no_code())), *payload[1:]))
        kernel.library.__class__ = _Library
        kernel.library._bitcode, kernel.library._shared_module = bitcode, None
        return kernel


def _folder_along(function: Callable[..., Any]) -> Path:
    return PRECOMPILED.joinpath(*function.__module__.split(".")[1:-1])


def fill(folder: Path) -> None:
    """Have this process keep and find its kernels in a folder that is to come along, instead of where Numba keeps them.
    To be called before any kernel is imported.
    """
    global PRECOMPILED
    PRECOMPILED = folder
    _Implementation._locator_classes = (_Along,)


class KernelCache(numba.core.caching.FunctionCache):  # type: ignore[misc, name-defined]
    """Of one kernel: Numba's, but for the stamp, the names of the files, that what came along is read too, and that
    nothing goes wrong in it: what cannot be read is a miss and goes, what cannot be written is compiled again the next
    time.

    Raises OSError or RuntimeError where the kernel's source cannot be read, or Numba is told of no place to write to.
    """

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        # Without the line on which the kernel begins: its files of old are overwritten when the kernel moves.
        self._file_name = _LINE_NUMBER.sub("", self._impl.filename_base)
        stamp = sources_hash(Path(inspect.getfile(function)).resolve())
        self._cache_file = _CheckedFiles(self.cache_path, self._file_name, stamp)
        self._precompiled = _CheckedFiles(str(_folder_along(function)), self._file_name, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled kernel for a signature; None where there is none, or a damaged one."""
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # damaged bytes raise whatever they like when they are unpickled
            self.flush()
            found = None
        if found is None:
            found = self._load_precompiled(sig, target_context)
            note_kernel(came_along=found is not None)
        return found

    def _load_precompiled(self, sig: Any, target_context: Any) -> Any:
        with suppress(Exception):
            data = self._precompiled.load(self._index_key(sig, target_context.codegen()))
            return data and self._impl.rebuild(target_context, data)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel, where the disk has room for it and nothing else lies in its place."""
        try:
            super().save_overload(sig, data)
        except BaseException as error:
            self.flush()  # the index may promise what is not there; a file may be written in part
            if not isinstance(error, Exception):
                raise

    def flush(self) -> None:
        """Remove all that is kept of this kernel, and whatever has its files' names."""
        for path in Path(self.cache_path).glob(f"{self._file_name}.*"):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                with suppress(OSError):
                    path.unlink()


class _CheckedFiles(numba.core.caching.IndexDataCacheFile):  # type: ignore[misc, name-defined]
    """Each with a digest at its end: what a crash has left of machine code would be run, or end the process. And named
    by its signature: two processes that count at the same time would give one number to code of two signatures.
    """

    def save(self, key: Any, data: Any) -> None:
        name = self._data_name(hashlib.sha256(repr(key).encode()).hexdigest()[:16])
        self._save_data(name, data)
        self._save_index({**self._load_index(), key: name})

    def _data_name(self, digest: str) -> str:
        return f"{self._index_name.removesuffix('.nbi')}.{digest}.nbc"

    def _dump(self, value: Any) -> bytes:
        data: bytes = super()._dump(value)
        return data + hashlib.sha256(data).digest()

    def _load_index(self) -> Any:
        with suppress(FileNotFoundError), open(self._index_path, "rb") as file:
            pickle.load(file)  # Numba's version stands before the rest
            _require_whole(file.read())
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        path = Path(self._data_path(name))
        _require_whole(path.read_bytes() if path.is_file() else b"")
        return super()._load_data(name)


def _require_whole(data: bytes) -> None:
    size = hashlib.sha256().digest_size
    if hashlib.sha256(data[:-size]).digest() != data[-size:]:
        raise ValueError("damaged")


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
