"""What is told while kernels are compiled."""

from __future__ import annotations

import pytest

from iibr_core.runtime import compiling
from iibr_core.runtime.compiling import COMPILING, KERNELS_OF_A_PHOTO, note_kernel, tell_compiling


@pytest.fixture(autouse=True)
def first_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a new process."""
    monkeypatch.setattr(compiling, "_first_run", compiling._FirstRun())


def test_each_kernel_is_told_with_the_share_that_is_done() -> None:
    told: list[str] = []
    with tell_compiling(told.append):
        for _ in range(KERNELS_OF_A_PHOTO + 9):
            note_kernel(came_along=False)
    assert told[0] == f"{COMPILING}, 0%"
    assert told[KERNELS_OF_A_PHOTO // 2].startswith(f"{COMPILING}, 50%")
    assert len(told) == KERNELS_OF_A_PHOTO + 9
    assert not any("101%" in words for words in told)


def test_who_has_waited_before_is_told_again() -> None:
    outer: list[str] = []
    inner: list[str] = []
    with tell_compiling(outer.append):
        with tell_compiling(inner.append):
            note_kernel(came_along=False)
        note_kernel(came_along=False)
    note_kernel(came_along=False)
    assert (len(outer), len(inner)) == (1, 1)


def test_nothing_is_told_where_kernels_came_along() -> None:
    told: list[str] = []
    with tell_compiling(told.append):
        note_kernel(came_along=True)
        note_kernel(came_along=False)
    assert told == []
