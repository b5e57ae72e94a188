"""Kernels kept on disk, in a small copy of the package whose files are edited between two processes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import iibr_core

ENCODING = """
from iibr_core.encoding_constants import GAIN
from iibr_core.runtime.jit import kernel, srgb_scalar


@kernel
def encode(linear):
    return _encode(linear) * GAIN


@kernel
def _encode(linear):
    return srgb_scalar(linear)
"""
CALL = """
from iibr_core.encoding import encode
value = encode(0.001)
print(value, sum(encode.stats.cache_hits.values()) if hasattr(encode, "stats") else 0)
"""


@pytest.fixture
def package(tmp_path):
    """A copy of the package with what kernels need, and one kernel that uses things of other files."""
    source = Path(iibr_core.__file__).parent
    copy = tmp_path / "iibr_core"
    for name in ("__init__.py", "runtime/__init__.py", "runtime/jit.py", "runtime/kernel_cache.py"):
        (copy / name).parent.mkdir(exist_ok=True, parents=True)
        (copy / name).write_text((source / name).read_text())
    (copy / "encoding.py").write_text(ENCODING)
    (copy / "encoding_constants.py").write_text("GAIN = 1.0\n")
    return copy


def encode_in_new_process(package, **environment):
    """(what the kernel gives, whether it came from the disk)."""
    kept = {**os.environ, "PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": str(package.parent / "kept")}
    run = subprocess.run(
        [sys.executable, "-c", CALL], env=kept | environment, cwd=package.parent, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    value, hits = run.stdout.split()
    return float(value), hits == "1"


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def kept_files(package):
    return sorted(path.name for path in (package.parent / "kept").rglob("*.nb?"))


def test_an_edit_of_an_inlined_file_is_noticed(package):
    assert encode_in_new_process(package) == (pytest.approx(0.01292), False)
    files = kept_files(package)
    (package / "other.py").write_text("GAIN = 3.0\n")
    assert encode_in_new_process(package) == (pytest.approx(0.01292), True), "the kernel imports no such file"

    edit(package / "runtime" / "jit.py", "return x * 12.92", "return x * 100.0")
    assert encode_in_new_process(package) == (pytest.approx(0.1), False)
    edit(package / "encoding_constants.py", "1.0", "2.0")
    edit(package / "encoding.py", "\n\n\n@kernel", "\n\n\n# lines move\n\n\n@kernel")
    assert encode_in_new_process(package) == (pytest.approx(0.2), False)
    assert kept_files(package) == files, "old entries are overwritten"


def test_a_damaged_entry_is_a_miss(package):
    encode_in_new_process(package)
    for ending in ("nbi", "nbc"):
        for path in (package.parent / "kept").rglob(f"*.{ending}"):
            path.write_bytes(path.read_bytes()[:-20])
        assert encode_in_new_process(package) == (pytest.approx(0.01292), False)
    assert encode_in_new_process(package)[1], "it was written anew"


def test_without_a_place_to_keep_them_kernels_run(package):
    (package.parent / "file").write_text("")
    nowhere = str(package.parent / "file" / "folder")
    locators = {"NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator", "NUMBA_CACHE_DIR": nowhere}
    assert encode_in_new_process(package, **locators) == (pytest.approx(0.01292), False)


def test_kernels_run_without_compiler(package):
    assert encode_in_new_process(package, NUMBA_DISABLE_JIT="1") == (pytest.approx(0.01292), False)
