"""Downloads of a model from a hub on this machine: resumed, and compared with what the hub states."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from iibr_core.depth.models.catalog import fetch, known_model
from iibr_core.depth.models.download import local_folder
from iibr_core.depth.models.known import USUAL_MODEL
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import InputError
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
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hub]:
    with local_hub(MODEL.commit, PUBLISHED) as server:
        # The library reads its variables once, at its import.
        monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", server.address)
        template = f"{server.address}/{{repo_id}}/resolve/{{revision}}/{{filename}}"
        monkeypatch.setattr("huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE", template)
        monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path))
        yield server


def require_whole() -> None:
    """A download succeeds, and nothing lies there but what was published and asked for."""
    folder = fetch(MODEL).folder
    found = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert found == {name: data for name, data in PUBLISHED.items() if name != "README.md"}


def test_a_stopped_download_is_resumed(hub: Hub) -> None:
    hub.may_finish.clear()
    part = local_folder(MODEL) / f"{WEIGHTS}.part"
    with pytest.raises(Cancelled), stoppable(lambda: part.is_file() and part.stat().st_size >= PIECE):
        fetch(MODEL)
    assert not part.with_name("model.onnx").exists()
    hub.may_finish.set()
    require_whole()
    assert hub.begins == [0, PIECE]


def test_a_connection_that_breaks_is_resumed(hub: Hub) -> None:
    hub.is_cut = True
    require_whole()
    assert hub.begins == [0, PIECE]


def test_other_bytes_than_the_hub_states_are_refused(hub: Hub) -> None:
    hub.files[WEIGHTS] = PUBLISHED[WEIGHTS][::-1]
    with pytest.raises(InputError, match=f"{WEIGHTS} is not what the hub states"):
        fetch(MODEL)
    assert not list(local_folder(MODEL).rglob("model.onnx*"))
    hub.files[WEIGHTS] = PUBLISHED[WEIGHTS]
    require_whole()


def test_a_hub_without_the_model_is_one_line(hub: Hub) -> None:
    hub.commit = "f" * 40
    with pytest.raises(InputError, match=rf"^{MODEL.repository} cannot be downloaded \(404[^\n]*$"):
        fetch(MODEL)
