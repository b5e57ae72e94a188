"""Values of command-line options from text."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import typer

from iibr_core.types import GridShape, ViewOffset
from viewer.cli.shared_options import (
    MAX_GRID,
    finite_from_text,
    grid_from_text,
    inpainter_from_text,
    not_negative_from_text,
    quality_from_text,
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
        (quality_from_text, "balanced", "balanced"),
        (inpainter_from_text, "background", "background"),
    ],
)
def test_values(parse: Callable[[str], object], text: str, value: object) -> None:
    assert parse(text) == value


@pytest.mark.parametrize(
    ("parse", "texts"),
    [
        (grid_from_text, ["", "0", "-3", "3x0", "2.5", "3x3x3", str(MAX_GRID + 1), "x", "9" * 5000]),
        (size_from_text, ["", "12", "0x5", "axb", "99999x1", "3x-3", "9" * 5000 + "x1"]),
        (view_from_text, ["", "1", "1,2,3", "a,b", "nan,0", "0,inf"]),
        (finite_from_text, ["", "nan", "inf", "1,5"]),
        (not_negative_from_text, ["", "nan", "-1", "-1e-300"]),
        (quality_from_text, ["", "best", "Fast"]),
        (inpainter_from_text, ["", "magic", "Background"]),
    ],
)
def test_nonsense_is_named(parse: Callable[[str], object], texts: list[str]) -> None:
    for text in texts:
        with pytest.raises(typer.BadParameter, match=f"^{text!r}".replace("(", r"\(")):
            parse(text)
