"""No model and no estimate is at hand but what a test puts there."""

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def folders_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("DATA", "CACHE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name.lower()))
    # The library reads its variables once, at its import.
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
