"""A model comes from a hub on this machine, however badly that answers: one plain line, nothing half there, and the
next try succeeds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from iibr_core.depth.estimators.catalog import USUAL_MODEL, fetch, known_model, model_here
from iibr_core.depth.estimators.download import VERIFIED
from iibr_core.runtime.work import Cancelled, stoppable, watched
from iibr_core.types import InputError
from tests.local_hub import Hub, local_hub

MODEL = known_model(USUAL_MODEL)
WEIGHTS = "onnx/model.onnx"
PUBLISHED = {
    "config.json": b'{"model_type": "depth_anything"}',
    "preprocessor_config.json": b"{}",
    "README.md": b"not asked for",
    WEIGHTS: bytes(range(256)) * 4096,
}
HALF = len(PUBLISHED[WEIGHTS]) // 2


@pytest.fixture
def hub(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Hub]:
    with local_hub(MODEL.commit, PUBLISHED) as hub:
        monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", hub.address)
        monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
        yield hub


def require_whole() -> None:
    """The next try succeeds, and what is there is what was published, and nothing else."""
    folder = fetch(MODEL).folder
    found = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    assert set(found) == {"config.json", "preprocessor_config.json", WEIGHTS, VERIFIED}
    assert all(found[name].read_bytes() == data for name, data in PUBLISHED.items() if name in found)
    assert [path.name for path in folder.parents[1].iterdir()] == ["snapshots"]
    assert model_here(MODEL) is not None


def refuse(status: int, **headers: str) -> Callable[[Hub], None]:
    def change(hub: Hub) -> None:
        hub.refusal = status, {name.replace("_", "-"): value for name, value in headers.items()}

    return change


def cut(hub: Hub) -> None:
    hub.cuts = True


def answer(text: bytes) -> Callable[[Hub], None]:
    def change(hub: Hub) -> None:
        hub.says = text

    return change


def alter(name: str) -> Callable[[Hub], None]:
    def change(hub: Hub) -> None:
        hub.files[name] = bytes(reversed(b"x" + hub.files[name][1:]))

    return change


def mend(hub: Hub) -> None:
    hub.refusal, hub.says, hub.cuts, hub.files = None, None, False, dict(PUBLISHED)


def test_redirected_files_come_whole(hub: Hub, tmp_path: Path) -> None:
    told: list[tuple[float, float]] = []
    with watched(lambda done, total, doing: told.append((done, total))):
        fetch(MODEL)
    total = sum(len(data) for name, data in PUBLISHED.items() if name != "README.md")
    assert told[-1] == (total, total)
    assert told == sorted(told)
    assert any(path.startswith("/large/") for path in hub.asked)
    require_whole()
    assert hub.begins == [0]  # what is here is not asked for again


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        (refuse(401), ("(401)", "licence", "HF_TOKEN")),
        (refuse(404), ("(404)", "HF_ENDPOINT", "--depth-model")),
        (refuse(429, Retry_After="17"), ("(429)", "try again in 17 s")),
        (refuse(500), ("(500)", "try again later", "HF_ENDPOINT")),
        (cut, ("network", "what has come is kept", "try again", "HF_ENDPOINT", "--depth-model FILE.onnx")),
        (alter(WEIGHTS), (f"{WEIGHTS} is not what the hub states", "get it again")),
        (alter("config.json"), ("config.json is not what the hub states", "get it again")),
        (answer(b"<html>Log in to this network</html>"), ("is no hub", "HF_ENDPOINT")),
        (answer(b'{"sha": 3, "siblings": [{"rfilename": "config.json"}]}'), ("is no hub", "HF_ENDPOINT")),
        (answer(b'{"siblings": null}'), ("is no hub", "HF_ENDPOINT")),
        (answer(b"[" + b" " * (1 << 25)), ("more than it states", "HF_ENDPOINT")),
    ],
)
def test_a_broken_download_is_one_line(
    hub: Hub, tmp_path: Path, fault: Callable[[Hub], None], says: tuple[str, ...]
) -> None:
    fault(hub)
    with pytest.raises(InputError) as caught:
        fetch(MODEL)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(MODEL.repository)
    assert all(words in line for words in says), line
    assert model_here(MODEL) is None
    assert not list(tmp_path.rglob("snapshots/*/onnx"))
    mend(hub)
    require_whole()
    if fault is cut:
        assert hub.begins == [0, HALF]


@pytest.mark.parametrize("knows_ranges", [True, False])
def test_a_cut_download_goes_on(hub: Hub, tmp_path: Path, knows_ranges: bool) -> None:
    hub.cuts, hub.knows_ranges = True, knows_ranges
    with pytest.raises(InputError, match="network"):
        fetch(MODEL)
    hub.cuts = False
    require_whole()
    assert hub.begins == [0, HALF]


def test_a_damaged_part_is_known_by_the_hash(hub: Hub, tmp_path: Path) -> None:
    hub.cuts = True
    with pytest.raises(InputError, match="network"):
        fetch(MODEL)
    mend(hub)
    (part,) = tmp_path.rglob("iibr-growing/*/onnx/model.onnx")
    part.write_bytes(b"x" * len(part.read_bytes()))
    with pytest.raises(InputError, match="is not what the hub states"):
        fetch(MODEL)
    require_whole()


def test_a_slow_download_is_given_up_at_once(hub: Hub, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The hub sends half and then nothing: only stopping ends it."""
    monkeypatch.setattr("iibr_core.depth.estimators.hub.TIMEOUT_S", 3600)
    hub.may_finish.clear()
    waits, begun = threading.Event(), len(PUBLISHED["config.json"])

    def report(done: float, total: float, doing: str) -> None:
        if done == begun + HALF:
            waits.set()

    with pytest.raises(Cancelled), stoppable(waits.is_set), watched(report):
        fetch(MODEL)
    assert not hub.lost_patience
    assert model_here(MODEL) is None
    hub.may_finish.set()
    require_whole()
    assert len(hub.begins) == 2


FETCH = (
    "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size})); "
    "from iibr_core.depth.estimators.catalog import fetch, known_model; "
    "from iibr_core.types import InputError\n"
    "try: fetch(known_model({name!r}))\n"
    "except InputError as error: print(error)"
)


def fetch_elsewhere(home: Path, most_bytes: int, **environment: str) -> str:
    """What a process of its own says, that may write files up to this size: the system refuses more."""
    code = FETCH.format(size=most_bytes, name=MODEL.name)
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "HF_HOME": str(home), **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    return done.stdout.strip()


def test_a_full_disk_is_told(hub: Hub, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "home" / "hub"))
    line = fetch_elsewhere(tmp_path / "home", HALF, HF_ENDPOINT=hub.address)
    assert line.startswith(f"{MODEL.repository} cannot be downloaded: {tmp_path / 'home' / 'hub'} cannot be written")
    assert "make room" in line
    assert "HF_HOME" in line
    assert model_here(MODEL) is None
    require_whole()
    assert hub.begins[1] > 0


@pytest.mark.parametrize("address", ["http://127.0.0.1:9"])
def test_no_network_names_the_ways_without_it(tmp_path: Path, address: str) -> None:
    line = fetch_elsewhere(tmp_path, 1 << 30, HF_ENDPOINT=address)
    assert line.startswith(f"{MODEL.repository} cannot be downloaded: the network fails")
    assert "HF_ENDPOINT" in line
    assert "--depth-model FILE.onnx" in line
    assert "\n" not in line
