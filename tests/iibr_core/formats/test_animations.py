"""Animations: what `tests/iibr_core/exports/test_animation.py` cannot reach through exports."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats import animations
from iibr_core.types import ImageSize, InputError


def test_a_build_of_pyav_without_the_encoder_is_refused_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("av")
    monkeypatch.setitem(animations.VIDEOS, ".mp4", ("libnone", {}))
    with pytest.raises(InputError, match=r"a\.mp4: PyAV here has no encoder libnone; write .gif or .webp"):
        animations.write_animation(tmp_path / "a.mp4", [np.zeros((4, 6, 3), np.uint8)], ImageSize(4, 6), 10.0)
    assert list(tmp_path.iterdir()) == []


def test_other_endings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"can be written as \.mp4, \.webm, \.gif, \.webp"):
        animations.write_animation(tmp_path / "a.png", [], ImageSize(4, 6), 10.0)
