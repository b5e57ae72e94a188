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
from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, distribution
from pathlib import Path

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
SPDX_OF_CLASSIFIER = {"MIT License": "MIT", "Apache Software License": "Apache-2.0", "ISC License (ISCL)": "ISC"}
SPDX_OF_NAME = {"numba": "BSD-2-Clause", "protobuf": "BSD-3-Clause", "defusedxml": "PSF-2.0"}
"""Licences of the libraries that state theirs in no standard form, as their texts have them."""
SOURCE_LABELS = "source", "source code", "repository", "homepage"
TEXT_FILE = re.compile(r"(?i).*(licen[cs]e|copying|notice|third.?party)[^.]*(\.(txt|md|rst|thirdparty))?")
STANDARD_TEXTS = {"Apache-2.0": ROOT / "LICENSE"}
"""Licence texts of the libraries that come without one."""
LIBRARY = re.compile(r"(?:lib)?(.+?)(?:-[0-9a-f]{8})*(?:-?\d+\.\d+)?\.(?:so|dylib|dll)(?:\.[\d.]+)?")
"""File name of a shared library; its group is the library's name."""
EXTENSION = re.compile(r".+\.(?:cpython-\w[\w-]*|abi3)\.so|.+\.pyd")
"""File name of a Python extension, which has the licence of its package."""
GPL = re.compile(r"A?GPL-[\d.]+(?:-only|-or-later)")
"""Licences that a plain installation must not hold; exceptions and alternatives make others of them."""
GPL_MARKS = (
    b"x264_encoder_open", b"x264 - core", b"x265_encoder_open", b"x265 [info]", b"libx264.", b"libx265.",
    b"libreadline.", b"libgdbm.", b"libxvidcore.", b"libpostproc.", b"libfftw3", b"liq_attr_create", b"--enable-gpl",
)  # fmt: skip
"""Bytes in shared libraries that hold GPL code or are linked with it."""
NATIVE_LIBRARIES = list(csv.DictReader((HERE / "native-libraries.csv").read_text("utf-8").splitlines()))
"""Native libraries in wheels and bundles; `within` names the library that they are compiled into, if there is one."""
SHARED_LIBRARIES = {name: row for row in NATIVE_LIBRARIES if not row["within"] for name in row["names"].split()}
"""Native libraries that are files, by their names without "lib", hash and version."""


def distributions(extra: str = "") -> dict[str, Distribution]:
    """Return what pyproject.toml requires and what that requires, by name; of an extra, all that it adds."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    plain, extras = _closure(project["dependencies"]), project["optional-dependencies"]
    return {name: lib for name, lib in _closure(extras[extra]).items() if name not in plain} if extra else plain


def _closure(requirements: Iterable[str]) -> dict[str, Distribution]:
    libraries: dict[str, Distribution] = {}
    waiting = list(requirements)
    while waiting:
        requirement = Requirement(waiting.pop())
        name = canonicalize_name(requirement.name)
        is_needed = requirement.marker is None or requirement.marker.evaluate({"extra": ""})
        if is_needed and name not in libraries:
            libraries[name] = distribution(name)
            waiting += libraries[name].requires or ()
    return dict(sorted(libraries.items()))


def licence_of(name: str, library: Distribution) -> str:
    """Return a library's licence as an SPDX expression. Raises LookupError if it is unknown."""
    stated = [library.metadata.get("License-Expression"), SPDX_OF_NAME.get(name), library.metadata.get("License")]
    classified = [text.split(" :: ")[-1] for text in library.metadata.get_all("Classifier") or ()]
    for text in [*stated, *map(SPDX_OF_CLASSIFIER.get, classified)]:
        try:
            return str(canonicalize_license_expression(text or ""))
        except InvalidLicenseExpression:
            continue
    raise LookupError(f"{name}: its licence is unknown; add it to SPDX_OF_NAME in packaging/licences.py")


def source_of(library: Distribution) -> str:
    """Return the address of a library's source, or of its page."""
    pairs = (text.partition(", ") for text in library.metadata.get_all("Project-URL") or ())
    addresses = {label.lower(): address for label, _, address in pairs}
    return next(filter(None, map(addresses.get, SOURCE_LABELS)), library.metadata.get("Home-page") or "")


def shared_libraries(library: Distribution) -> list[Path]:
    """Return the files of a distribution that are shared libraries or extensions."""
    return [Path(str(library.locate_file(file))) for file in library.files or () if native_name(file.name) is not None]


def native_name(file: str) -> str | None:
    """Return the name of a shared library without hash and version, "" for a Python extension, None for other files."""
    if EXTENSION.fullmatch(file):
        return ""
    match = LIBRARY.fullmatch(file)
    return match and match[1]


def faults(files: Iterable[Path]) -> Iterator[str]:
    """Yield a sentence about each shared library that is unknown or holds code under the GPL."""
    for path in sorted(files):
        name, content = native_name(path.name), path.read_bytes()
        licence = SHARED_LIBRARIES.get(name, {}).get("licence", "")
        marks = [mark.decode() for mark in GPL_MARKS if mark in content]
        if name and not licence:
            yield f"{path}: is not in packaging/native-libraries.csv; add {name!r} with its licence and source"
        elif GPL.fullmatch(licence):
            yield f"{path}: is under {licence}; a plain installation must not hold it"
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


def _native_rows(libraries: Iterable[Distribution]) -> list[tuple[str, ...]]:
    """Return a row for each project whose native libraries these hold, as files or compiled in."""
    rows = []
    for library in libraries:
        # Of links to one library, the last and longest name counts.
        files = {native_name(path.name): path.name for path in sorted(shared_libraries(library))}
        for names, licence, source, within in map(dict.values, NATIVE_LIBRARIES):
            held = [re.sub(r"-[0-9a-f]{8}", "", files[name]) for name in names.split() if name in files and not within]
            if held:
                rows.append((", ".join(held), library.name, licence, source))
            elif within == library.name:
                rows.append((names, f"{library.name}, compiled in", licence, source))
    return sorted(rows, key=lambda row: row[0].lower())


def _table(title: str, head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return f"## {title}\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)


def texts() -> str:
    """Return the licence texts of a plain installation, of Python and of the native libraries."""
    rows = [", ".join(native.values()) for native in NATIVE_LIBRARIES if not GPL.fullmatch(native["licence"])]
    parts = {"iibr": (ROOT / "LICENSE").read_text("utf-8")}
    parts |= dict(_text_of(name, library) for name, library in distributions().items())
    parts["Native libraries: names, licence, source, library that holds them"] = "\n".join(rows)
    for file in [*Path(sysconfig.get_path("stdlib")).glob("LICENSE.txt"), *sorted((HERE / "licence-texts").iterdir())]:
        parts[file.stem.replace("LICENSE", "Python")] = file.read_text("utf-8")
    line = "=" * 80
    return "\n".join(f"{line}\n{title}\n{line}\n\n{text}\n" for title, text in parts.items())


def _text_of(name: str, library: Distribution) -> tuple[str, str]:
    """Return a heading and a library's licence texts, after the names in its bill of materials."""
    licence, files = licence_of(name, library), [Path(str(library.locate_file(file))) for file in library.files or ()]
    found = [file for file in files if TEXT_FILE.fullmatch(file.name)] or [STANDARD_TEXTS[licence]]
    bills = [json.loads(file.read_text("utf-8")) for file in files if "sboms" in file.parts]
    components = [part for bill in bills for part in bill.get("components", ()) if part.get("scope") != "optional"]
    names = ", ".join(f"{part['name']} {part.get('version') or ''}".strip() for part in components)
    held = f"Compiled in: {names}.\n\n" if components else ""
    text = held + "\n".join(file.read_text("utf-8", "replace") for file in found)
    return f"{library.name} {library.version}, {licence}, {source_of(library)}", text


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
        files = [path for path in options.check.rglob("*") if native_name(path.name) is not None and path.is_file()]
        found = list(faults(files)) if files else [f"{options.check}: holds no shared library; name another folder"]
        sys.stderr.writelines(f"{fault}\n" for fault in found)
        return bool(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
