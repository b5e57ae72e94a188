"""Licences of the libraries of an installation: a plain one holds nothing under the GPL, and all are listed."""

import runpy
import subprocess
import sys
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "packaging/licences.py"
LICENCES = runpy.run_path(str(SCRIPT))


def run(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-P", SCRIPT, *words], capture_output=True, text=True)


def test_no_shared_library_of_a_plain_installation_is_under_the_gpl_or_unknown() -> None:
    libraries = LICENCES["distributions"]()
    assert {"numpy", "pi-heif", "llvmlite", "pydantic-core"} <= libraries.keys()
    files = [file for library in libraries.values() for file in LICENCES["shared_libraries"](library)]
    assert list(LICENCES["faults"](files)) == []
    assert {"heif", "de265", "llvmlite", "OpenImageIO", ""} <= {LICENCES["native_name"](file.name) for file in files}


@pytest.mark.parametrize(("library", "name"), [("av", "libx264"), ("pillow-heif", "libx265")])
def test_wheels_with_gpl_encoders_are_found(library: str, name: str) -> None:
    files = LICENCES["shared_libraries"](distribution(library))
    found = list(LICENCES["faults"](files))
    assert any(name in fault and "GPL-2.0-or-later" in fault for fault in found)
    assert any("libheif" in fault or "libavcodec" in fault for fault in found), "what is linked with an encoder"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("libz.so.1", b"", ""),
        ("liblzma-de26b416.so.5.8.4", b"", ""),
        ("libpython3.11.so.1.0", b"", ""),
        ("_ssl.cpython-311-x86_64-linux-gnu.so", b"", ""),
        ("libsurprise-0123abcd.so.2", b"", "add 'surprise' with its licence and source"),
        ("libx265-5385bbf8.so.216", b"", "is under GPL-2.0-or-later"),
        ("readline.cpython-311-x86_64-linux-gnu.so", b"\0libreadline.so.8\0", "linked with it (libreadline.)"),
        ("libz.so.1", b"x264 - core 165", "holds code under the GPL"),
        ("readme.txt", b"x264 - core 165", "holds no shared library"),
    ],
)
def test_a_bundle_is_judged_by_its_shared_libraries(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / name).write_bytes(content)
    done = run("--check", tmp_path)
    assert done.returncode == bool(words)
    assert words in done.stderr


def test_the_page_and_the_texts_hold_each_library(tmp_path: Path) -> None:
    done = run("--output", tmp_path / "page.md", "--texts", tmp_path / "texts.txt")
    assert done.returncode == 0, done.stderr
    files = tmp_path / "page.md", ROOT / "docs/licences.md", tmp_path / "texts.txt"
    page, committed, texts = (file.read_text("utf-8") for file in files)
    plain = [library.name for library in LICENCES["distributions"]().values()]
    extra = [library.name for library in LICENCES["distributions"]("export").values()]
    assert set(extra) == {"av", "pillow_heif"}
    assert all(f"| {name} |" in page for name in plain + extra)
    assert all(f"| {name} |" in committed for name in plain + extra), "run `make licences`"
    assert all(f"\n{name} " in texts for name in plain)
    assert not any(f"\n{name} " in texts for name in extra)
    assert "GNU LESSER GENERAL PUBLIC LICENSE" in texts
    assert "Numba source tree includes vendored libraries" in texts, "a second file of licences"


def test_an_unknown_licence_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "METADATA").write_text("Name: odd\nLicense: mine\n")
    library = Distribution.at(tmp_path)
    with pytest.raises(LookupError, match="odd: its licence is unknown"):
        LICENCES["licence_of"]("odd", library)
