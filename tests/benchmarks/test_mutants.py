"""Small faults: all that a file could have, the same ones by seed; tests find them or do not."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from benchmarks.mutants import choose, failing_test
from benchmarks.small_faults import faults_of

SOURCE = '''"""At most 3 of them."""
import numpy as np

MOST: int = 3


def least(values: list[float], most: int = 5) -> float:
    """The least of 2."""
    found = 7.0
    for k in range(1, most):
        if values[k] < found and k != 4:
            found = values[k] + 1
    return max(found, np.zeros(9)[0])
'''
TEST = """from room import least


def test_the_least():
    assert least([9.0, 5.0, 6.0, 8.0, 1.0]) == 6.0
"""


def test_every_fault_is_another_program() -> None:
    sources = [fault.source for fault in faults_of("room.py", SOURCE)]
    programs = {ast.dump(ast.parse(source)) for source in (SOURCE, *sources)}
    assert len(programs) == len(sources) + 1


@pytest.mark.parametrize(
    ("was", "now"),
    [
        ("values[k] < found", "values[k] > found"),
        ("values[k] < found", "values[k] <= found"),
        ("k != 4", "k == 4"),
        ("values[k] < found and k != 4", "values[k] < found or k != 4"),
        ("values[k] < found and k != 4", "not (values[k] < found and k != 4)"),
        ("values[k] + 1", "values[k] - 1"),
        ("values[k]", "values[k + 1]"),
        ("7.0", "14.0"),
        ("7.0", "3.5"),
        ("max(", "min("),
        ("found = values[k] + 1", "pass"),
    ],
)
def test_each_kind_of_fault_is_there(was: str, now: str) -> None:
    faulty = ast.dump(ast.parse(SOURCE.replace(was, now, 1)))
    assert faulty in {ast.dump(ast.parse(fault.source)) for fault in faults_of("room.py", SOURCE)}


def test_texts_types_defaults_and_room_for_arrays_stay() -> None:
    changed = {fault.what.partition("`")[2].partition("`")[0] for fault in faults_of("room.py", SOURCE)}
    assert not changed & {"3", "5", "9", "2"}


def test_a_seed_chooses_the_same_faults() -> None:
    every = list(faults_of("room.py", SOURCE))
    assert choose(every, 3, 5) == choose(every, 3, 5)
    assert choose(every, 3, 5) != choose(every, 4, 5)
    assert len(choose(every, 0, 10_000)) == len(every)


def test_a_fault_is_found_by_its_test(tmp_path: Path) -> None:
    (tmp_path / "test_room.py").write_text(TEST)
    (tmp_path / "room.py").write_text(SOURCE)
    assert not failing_test(tmp_path, ["test_room.py"])
    turned = next(fault for fault in faults_of("room.py", SOURCE) if "`(values[k] > found)`" in fault.what)
    (tmp_path / "room.py").write_text(turned.source)
    assert failing_test(tmp_path, ["test_room.py"]) == "test_room.py::test_the_least"
