"""Comparing what a person is told (words, numbers, lists) with kept texts: words exactly, numbers by a tolerance."""

import re
from collections.abc import Sequence

import pytest

from tests.golden_rows import keep_row, read_rows

NUMBER = re.compile(r"-?\d+\.\d+")


def assert_same_text(
    lines: Sequence[str], name: str, row: str, regenerate: bool, atol: float = 0.02, rtol: float = 0.01
) -> None:
    """Compare lines with the row of a golden table; numbers with a point may differ by the tolerance."""
    if regenerate:
        keep_row(name, row, list(lines))
        return
    found, expected = "\n".join(lines), "\n".join(read_rows(name)[row])
    assert NUMBER.sub("#", found) == NUMBER.sub("#", expected), f"{found}\n--- expected:\n{expected}"
    numbers, wanted = ([float(number) for number in NUMBER.findall(text)] for text in (found, expected))
    assert numbers == pytest.approx(wanted, abs=atol, rel=rtol), f"{found}\n--- expected:\n{expected}"
