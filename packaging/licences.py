"""Lists the libraries of an installation with their licences, and finds those that a plain installation must not hold.

`--output FILE` writes docs/licences.md, `--texts FILE` the licence texts that a bundle carries, `--check FOLDER` judges
the shared libraries of a folder. All fail where a licence or a native library is unknown.
"""

import argparse
import csv
import json
import re
import sys
import sysconfig
import tomllib
from collections.abc import Collection, Iterable, Iterator
from importlib.metadata import Distribution, distribution
from pathlib import Path
from typing import NamedTuple

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

HERE = Path(__file__).parent
ROOT = HERE.parent
HEAD = """# Licences

iibr is under the Apache License 2.0. It uses these libraries, each under a licence of its own. A plain installation
and the bundles hold no library under the GPL. HEIC is read by libheif and libde265, which are under the LGPL: they are
files of their own and can be replaced. The extra `export` is installed only where it is asked for: its encoders x264
and x265 are under the GPL. Bundles carry all licence texts in one file. `make licences` makes this page, on Linux.
"""
SPDX_OF_CLASSIFIER = {
    "MIT License": "MIT",
    "Apache Software License": "Apache-2.0",
    "ISC License (ISCL)": "ISC",
    "Python Software Foundation License": "PSF-2.0",
}
SPDX_OF_NAME = {"numba": "BSD-2-Clause", "protobuf": "BSD-3-Clause"}
"""Licences of the libraries that state theirs in no standard form, as their texts have them."""
SOURCE_LABELS = "source", "source code", "repository", "github", "code", "homepage"
TEXT_FILE = re.compile(r"licen[cs]e|copying|notice|third.?party", re.IGNORECASE)
STANDARD_TEXTS = {"Apache-2.0": ROOT / "LICENSE"}
LIBRARY = re.compile(r"(?:lib)?(.+?)(?:-[0-9a-f]{8})*(?:-?\d+\.\d+)?\.(?:so|dylib|dll)(?:\.[\d.]+)?")
"""File name of a shared library; its group is the library's name."""
EXTENSION = re.compile(r".+\.(?:cpython-\w[\w-]*|abi3)\.so|.+\.pyd|_?\w+\.\w*-?darwin\.so")
"""File name of a Python extension, which has the licence of its package."""
GPL = re.compile(r"A?GPL-[\d.]+(?:-only|-or-later)")
"""Licences that a plain installation must not hold; exceptions and alternatives make others of them."""
GPL_MARKS = (
    b"x264_encoder_open", b"x264 - core", b"x265_encoder_open", b"x265 [info]", b"libx264.", b"libx265.",
    b"libreadline.", b"libgdbm.", b"libxvidcore.", b"libpostproc.", b"libfftw3", b"liq_attr_create", b"--enable-gpl",
)  # fmt: skip
"""Bytes in shared libraries that hold GPL code or are linked with it."""


class NativeLibrary(NamedTuple):
    """Native libraries that wheels or bundles hold: licence (SPDX) and address of their source.

    within: library that they are compiled into, "" for files of their own.
    """

    names: str
    licence: str
    source: str
    within: str


with (HERE / "native-libraries.csv").open(encoding="utf-8", newline="") as table:
    NATIVE_LIBRARIES = tuple(NativeLibrary(**row) for row in csv.DictReader(table))
SHARED_LIBRARIES = {name: row for row in NATIVE_LIBRARIES if not row.within for name in row.names.split()}
"""The native libraries that are files of their own, by their names without "lib", hash and version."""


def distributions(extra: str = "") -> dict[str, Distribution]:
    """Return what pyproject.toml requires and what that requires, by name; of an extra, all that it adds."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    plain = _closure(project["dependencies"], {})
    return _closure(project["optional-dependencies"][extra], plain) if extra else plain


def _closure(requirements: Iterable[str], known: dict[str, Distribution]) -> dict[str, Distribution]:
    found: dict[str, Distribution] = {}
    waiting = list(requirements)
    while waiting:
        requirement = Requirement(waiting.pop())
        name = canonicalize_name(requirement.name)
        if name in known or name in found or not _is_needed(requirement):
            continue
        found[name] = distribution(name)
        waiting += found[name].requires or ()
    return dict(sorted(found.items()))


def _is_needed(requirement: Requirement) -> bool:
    return requirement.marker is None or requirement.marker.evaluate({"extra": ""})


def licence_of(name: str, library: Distribution) -> str:
    """Return a library's licence as an SPDX expression. Raises LookupError if it is unknown."""
    metadata = library.metadata
    stated = [metadata.get("License-Expression"), SPDX_OF_NAME.get(name), metadata.get("License")]
    classified = [text.split(" :: ")[-1] for text in metadata.get_all("Classifier") or ()]
    for text in [*stated, *map(SPDX_OF_CLASSIFIER.get, classified)]:
        try:
            return str(canonicalize_license_expression(text or ""))
        except InvalidLicenseExpression:
            continue
    raise LookupError(f"{name}: its licence is unknown; add it to SPDX_OF_NAME in packaging/licences.py")


def source_of(library: Distribution) -> str:
    """Return the address of a library's source, or of its page."""
    pairs = [text.split(", ", 1) for text in library.metadata.get_all("Project-URL") or ()]
    addresses = {label.lower(): address for label, address in pairs}
    labelled = (addresses[label] for label in SOURCE_LABELS if label in addresses)
    return next(labelled, library.metadata.get("Home-page") or "")


def shared_libraries(library: Distribution) -> list[Path]:
    """Return the files of a distribution that are shared libraries or extensions."""
    return [Path(str(library.locate_file(file))) for file in library.files or () if _is_shared(file.name)]


def _is_shared(name: str) -> bool:
    return bool(EXTENSION.fullmatch(name) or LIBRARY.fullmatch(name))


def native_name(path: Path) -> str:
    """Return the name of a shared library without hash and version, "" for a Python extension."""
    match = LIBRARY.fullmatch(path.name)
    return "" if match is None or EXTENSION.fullmatch(path.name) else match[1]


def faults(files: Iterable[Path]) -> Iterator[str]:
    """Yield a sentence about each shared library that is unknown or holds code under the GPL."""
    for path in sorted(files):
        name, content = native_name(path), path.read_bytes()
        native = SHARED_LIBRARIES.get(name)
        marks = [mark.decode() for mark in GPL_MARKS if mark in content]
        if name and native is None:
            yield f"{path}: is not in packaging/native-libraries.csv; add {name!r} with its licence and source"
        elif native is not None and GPL.fullmatch(native.licence):
            yield f"{path}: is under {native.licence}; a plain installation must not hold it"
        elif marks:
            yield f"{path}: holds code under the GPL, or is linked with it ({', '.join(marks)})"


def page() -> str:
    """Return docs/licences.md."""
    parts = [HEAD]
    for title, extra in (("A plain installation", ""), ("The extra `export`", "export")):
        libraries = distributions(extra)
        rows = [(lib.name, lib.version, licence_of(name, lib), source_of(lib)) for name, lib in libraries.items()]
        parts.append(_table(title, ("library", "version", "licence", "source"), rows))
        rows = _native_rows(libraries.values())
        parts.append(_table(f"{title}: native libraries", ("library", "in", "licence", "source"), rows))
    return "\n".join(parts)


def _native_rows(libraries: Collection[Distribution]) -> list[tuple[str, ...]]:
    """Return a row for each project whose native libraries these hold, as files or compiled in."""
    rows = []
    for library in libraries:
        files = {native_name(path): path.name for path in sorted(shared_libraries(library))}  # of links, the longest
        for native in NATIVE_LIBRARIES:
            if native.within == library.name:
                rows.append((native.names, f"{library.name}, compiled in", native.licence, native.source))
            held = [files[name] for name in native.names.split() if name in files and not native.within]
            if held:
                names = re.sub(r"-[0-9a-f]{8}", "", ", ".join(held))
                rows.append((names, library.name, native.licence, native.source))
    return sorted(rows, key=lambda row: row[0].lower())


def _table(title: str, head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return f"## {title}\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)


def texts() -> str:
    """Return the licence texts of a plain installation, of Python and of the native libraries."""
    parts = [_heading("iibr", (ROOT / "LICENSE").read_text("utf-8"))]
    parts += [_texts_of(name, library) for name, library in distributions().items()]
    python = Path(sysconfig.get_path("stdlib"), "LICENSE.txt")
    files = [*([python] if python.is_file() else []), *sorted((HERE / "licence-texts").iterdir())]
    rows = [", ".join(native) for native in NATIVE_LIBRARIES if not GPL.fullmatch(native.licence)]
    parts.append(_heading("Native libraries: names, licence, source, library that holds them", "\n".join(rows)))
    parts += [_heading(file.stem if file != python else "Python", file.read_text("utf-8")) for file in files]
    return "\n".join(parts)


def _texts_of(name: str, library: Distribution) -> str:
    """Return a library's licence texts, after the names in its bill of materials."""
    licence = licence_of(name, library)
    files = [library.locate_file(file) for file in library.files or ()]
    found = [Path(str(file)).read_text("utf-8", "replace") for file in files if _is_text(file)]
    if not found:
        found = [STANDARD_TEXTS[licence].read_text("utf-8")]
    bills = [json.loads(Path(str(file)).read_text("utf-8")) for file in files if "sboms" in str(file)]
    components = [part for bill in bills for part in bill.get("components", ()) if part.get("scope") != "optional"]
    names = ", ".join(f"{part['name']} {part.get('version') or ''}".strip() for part in components)
    held = f"Compiled in: {names}.\n\n" if components else ""
    return _heading(f"{library.name} {library.version}, {licence}, {source_of(library)}", held + "\n".join(found))


def _is_text(file: object) -> bool:
    path = Path(str(file))
    return TEXT_FILE.search(path.name) is not None and path.suffix in ("", ".txt", ".md", ".rst", ".thirdparty")


def _heading(title: str, text: str) -> str:
    return f"{'=' * 80}\n{title}\n{'=' * 80}\n\n{text}\n"


def main() -> int:
    """Write the files that the options name, and judge the folder; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, help="page to write, in Markdown")
    parser.add_argument("--texts", type=Path, help="file for all licence texts")
    parser.add_argument("--check", type=Path, help="folder whose shared libraries are judged")
    options = parser.parse_args()
    if options.output:
        options.output.write_text(page(), "utf-8")
    if options.texts:
        options.texts.write_text(texts(), "utf-8")
    if options.check:
        files = [path for path in options.check.rglob("*") if path.is_file() and _is_shared(path.name)]
        found = list(faults(files)) if files else [f"{options.check}: holds no shared library; name another folder"]
        sys.stderr.writelines(f"{fault}\n" for fault in found)
        return bool(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
