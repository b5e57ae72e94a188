"""Values of command-line options from text."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from iibr_core.types import GridShape, ViewOffset
from viewer.cli.shared_options import (
    finite_from_text,
    grid_from_text,
    inpainter_from_text,
    size_from_text,
    view_from_text,
)


@pytest.mark.parametrize(
    ("parse", "text", "value"),
    [
        (grid_from_text, "9", GridShape(9, 9)),
        (grid_from_text, "3x10", GridShape(3, 10)),
        (size_from_text, "1280x800", (1280, 800)),
        (view_from_text, "2,-1.5", ViewOffset(t=-1.5, s=2.0)),
        (view_from_text, "-0, 1e1", ViewOffset(t=10.0, s=0.0)),
        (finite_from_text, "-1e-3", -0.001),
        (inpainter_from_text, "background", "background"),
    ],
)
def test_values(parse: Callable[[str], object], text: str, value: object) -> None:
    assert parse(text) == value
