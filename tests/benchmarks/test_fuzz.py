"""Fuzzing reads every valid file, and finds a reader that fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.fuzz import fault_of, fuzz, samples
from iibr_core.types import InputError


def test_every_valid_file_is_read_and_some_copies_are_refused(tmp_path: Path) -> None:
    readers = samples(tmp_path / "now")
    assert len(readers) > 25
    for path, read in readers.items():
        assert fault_of(read, path) == "", path.name
    assert list(fuzz(readers, 2, 0, tmp_path)) == []


def test_a_planted_crash_is_found_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "now.txt"
    path.write_bytes(b"1 2 3 " * 50)

    def read(file: Path) -> list[np.ndarray]:
        if len(file.read_bytes()) < 100:
            raise IndexError("short")
        return [np.array([1.0])]

    findings = list(fuzz({path: read}, 60, 1, tmp_path))
    assert findings
    assert all("IndexError in test_fuzz.py, read: 'short'" in line for line in findings)
    kept = tmp_path / findings[0].split(":")[0]
    assert len(kept.read_bytes()) < 100
    assert path.read_bytes() == b"1 2 3 " * 50


@pytest.mark.parametrize(
    ("message", "result", "fault"),
    [("one line", None, ""), ("two\nlines", None, "several"), ("", [np.array([np.nan])], "not finite")],
)
def test_faults_are_told_from_refusals(message: str, result: list[np.ndarray] | None, fault: str) -> None:
    def read(path: Path) -> list[np.ndarray] | None:
        if message:
            raise InputError(message)
        return result

    assert fault in fault_of(read, Path("a"))
    assert bool(fault) == bool(fault_of(read, Path("a")))
