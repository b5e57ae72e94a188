"""Downloads of a model from a hub on this machine, by `iibr models get` in a process, as users run it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from iibr_core.depth.models.catalog import known_model
from iibr_core.depth.models.known import USUAL_MODEL
from tests.local_hub import Hub, local_hub

MODEL = known_model(USUAL_MODEL)
WEIGHTS = "onnx/model.onnx"
PIECE = 10 * 2**20
"""Bytes that the library writes at a time."""
PUBLISHED = {
    "config.json": b'{"model_type": "depth_anything"}',
    "preprocessor_config.json": b"{}",
    "README.md": b"not asked for",
    WEIGHTS: bytes(range(256)) * (PIECE // 100),
}


@pytest.fixture
def hub() -> Iterator[Hub]:
    with local_hub(MODEL.commit, PUBLISHED) as hub:
        yield hub


def start(hub: Hub, home: Path) -> subprocess.Popen[str]:
    """Start a download. The hub's library reads its address once, at its import."""
    command = [sys.executable, "-P", "-m", "viewer", "models", "get", MODEL.name, "--yes"]
    environment = {**os.environ, "HF_ENDPOINT": hub.address, "HF_HOME": str(home), "XDG_DATA_HOME": str(home)}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def error_of(hub: Hub, home: Path) -> str:
    """Return the last line of a download that fails."""
    process = start(hub, home)
    _, errors = process.communicate(timeout=100)
    assert process.returncode == 2
    return errors.splitlines()[-1]


def require_whole(hub: Hub, home: Path) -> None:
    """A download succeeds, and nothing lies there but what was published and asked for."""
    process = start(hub, home)
    output, errors = process.communicate(timeout=100)
    assert process.returncode == 0, errors
    assert MODEL.commit in output
    (folder,) = home.rglob(f"snapshots/{MODEL.commit}")
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    assert {name: path.read_bytes() for name, path in found.items()} == {
        name: data for name, data in PUBLISHED.items() if name != "README.md"
    }


def test_an_interrupted_download_is_resumed(hub: Hub, tmp_path: Path) -> None:
    hub.may_finish.clear()
    process = start(hub, tmp_path)
    end = time.monotonic() + 60
    while sum(part.stat().st_size for part in tmp_path.rglob("model.onnx.part")) < PIECE and time.monotonic() < end:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    assert not list(tmp_path.rglob("model.onnx"))
    hub.may_finish.set()
    require_whole(hub, tmp_path)
    assert hub.begins == [0, PIECE]


def test_other_bytes_than_the_hub_states_are_refused(hub: Hub, tmp_path: Path) -> None:
    hub.files[WEIGHTS] = PUBLISHED[WEIGHTS][::-1]
    assert f"{WEIGHTS} is not what the hub states" in error_of(hub, tmp_path)
    assert not list(tmp_path.rglob("model.onnx*"))
    hub.files[WEIGHTS] = PUBLISHED[WEIGHTS]
    require_whole(hub, tmp_path)


def test_a_hub_without_the_model_is_one_line(hub: Hub, tmp_path: Path) -> None:
    hub.commit = "f" * 40
    error = error_of(hub, tmp_path)
    assert error.startswith(f"iibr: {MODEL.repository} cannot be downloaded (404")
    assert "HF_ENDPOINT" in error
    assert "an ONNX file of your own" in error
