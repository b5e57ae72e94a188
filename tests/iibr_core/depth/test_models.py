import json
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.models import cache, catalog
from iibr_core.depth.models.download import local_folder
from iibr_core.depth.models.known import USUAL_MODEL
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import InputError
from tests.iibr_core.depth.onnx_graphs import weighing
from tests.iibr_core.depth.test_onnx import with_external_weights
from tests.local_hub import Hub, local_hub


def files_below(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", [USUAL_MODEL, "depth-pro"])
def test_a_known_model_is_here_once_all_of_its_files_are(tmp_path, name) -> None:
    model = catalog.known_model(name)
    with pytest.raises(InputError, match=f"{name} is not on this machine"):
        catalog.model_to_use(DepthChoice("model", model=None if name == USUAL_MODEL else name))
    folder = tmp_path / "hub" / f"models--{model.repository.replace('/', '--')}" / "snapshots" / model.commit
    for file in model.files:
        assert catalog.model_here(model) is None
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / Path(file).name).write_text("{}")
        (folder / file).symlink_to(tmp_path / Path(file).name)
    found = catalog.model_to_use(DepthChoice("model", model=name))
    assert (found.title, found.folder, found.weights) == (model.title, folder, (folder / model.files[-1],))
    assert found.is_meaning_known
    assert model.is_recommended == (name == USUAL_MODEL)
    assert catalog.model_at_hand() == (found if name == USUAL_MODEL else None), "only what runs as installed"


def test_a_folder_with_several_files_asks_which(tmp_path) -> None:
    for name in ("a.onnx", "b.onnx"):
        weighing(tmp_path / name, (1, 0, 0))
    with pytest.raises(InputError, match="several ONNX files"):
        catalog.model_to_use(DepthChoice(model=str(tmp_path)))
    file = weighing(tmp_path / "model.onnx", (1, 0, 0))
    (tmp_path / "model.safetensors").touch()
    for kind, runner, weights in (
        ("depth_anything", "onnx", file),
        ("zoedepth", "transformers", tmp_path / "model.safetensors"),
    ):
        (tmp_path / "config.json").write_text(json.dumps({"model_type": kind}))
        found = catalog.model_to_use(DepthChoice(model=str(tmp_path)))
        assert (found.runner, found.weights) == (runner, (weights,)), "only ZoeDepth's weights say that it gives metres"


def test_a_model_is_named_by_its_file_or_its_folder_and_others_are_refused(tmp_path) -> None:
    (tmp_path / "halls" / "onnx").mkdir(parents=True)
    assert catalog.register(weighing(tmp_path / "halls" / "onnx" / "model.onnx", (1, 0, 0))).name == "halls"
    assert catalog.register(weighing(tmp_path / "rooms.onnx", (0, 1, 0))).name == "rooms"
    assert list(catalog.list_own_models()) == ["halls", "rooms"]
    (tmp_path / "notes.txt").touch()
    for wanted, message in (
        (str(tmp_path / "gone"), "no such file or folder"),
        ("gone.onnx", "no such file or folder"),
        (str(tmp_path / "notes.txt"), "is not an ONNX file"),
        ("gone", f"no depth model of this name is known; there are {USUAL_MODEL}, .*zoedepth.*, halls, rooms$"),
    ):
        with pytest.raises(InputError, match=message):
            catalog.model_to_use(DepthChoice(model=wanted))


def test_the_estimates_that_were_used_last_are_kept(monkeypatch) -> None:
    values = np.arange(600, dtype=np.float32).reshape(20, 30)
    monkeypatch.setattr(cache, "MAX_BYTES", 3 * (values.nbytes + 600))
    for at, key in enumerate("abc"):
        cache.store(key, DepthEstimate(values + at, "metres", 1.5))
        os.utime(cache.cache_folder() / f"{key}.npz", (at, at))
    found = cache.load("a")
    assert (found.meaning, found.focal_ratio, found.values[0, 1]) == ("metres", 1.5, 1.0)
    cache.store("d", DepthEstimate(values, "inverse depth"))
    assert [cache.load(key) is not None for key in "abcd"] == [True, False, True, True], "a was looked up since"
    assert cache.load("d").focal_ratio is None
    monkeypatch.setattr(cache, "MAX_BYTES", 10)
    cache.store("large", DepthEstimate(values, "disparity"))
    assert [cache.load(key) is not None for key in ("a", "c", "large")] == [False, False, True], "the newest stays"
    (cache.cache_folder() / "large.npz").write_bytes(b"damaged")
    assert cache.load("large") is None


def test_a_copied_model_brings_its_numbers_and_settings_along(tmp_path) -> None:
    file = with_external_weights(tmp_path / "rooms.onnx")
    (tmp_path / "config.json").write_text('{"depth_estimation_type": "metric"}')
    assert catalog.register(file).title == "the model rooms"
    file.unlink()
    assert list(catalog.list_own_models()) == ["rooms"]
    expected = {"rooms/rooms.onnx", "rooms/rooms.onnx_data", "rooms/config.json"}
    assert files_below(catalog.own_models_folder()) == expected
    assert catalog.model_to_use(DepthChoice(model="rooms")) is not None


def test_a_name_that_is_taken_stays_with_its_model(tmp_path) -> None:
    first, other = weighing(tmp_path / "a.onnx", (1, 0, 0)), tmp_path / "other"
    other.mkdir()
    before = catalog.register(first)
    assert catalog.register(first) == before
    with pytest.raises(InputError, match=r"another model has this name; rename .*a\.onnx"):
        catalog.register(weighing(other / "a.onnx", (0, 1, 0)))
    with pytest.raises(InputError, match="zoedepth is the name of a published model; rename the file"):
        catalog.register(weighing(other / "zoedepth.onnx", (0, 1, 0)))


MODEL = catalog.known_model(USUAL_MODEL)
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
def hub(tmp_path, monkeypatch) -> Iterator[Hub]:
    with local_hub(MODEL.commit, PUBLISHED) as server:
        # The library reads its variables once, at its import.
        monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", server.address)
        template = f"{server.address}/{{repo_id}}/resolve/{{revision}}/{{filename}}"
        monkeypatch.setattr("huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE", template)
        monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path))
        yield server


def require_whole() -> None:
    folder = catalog.fetch(MODEL).folder
    found = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert found == {name: data for name, data in PUBLISHED.items() if name != "README.md"}


@pytest.mark.parametrize("is_cut", [False, True], ids=["stopped", "cut off"])
def test_a_download_is_resumed(hub, is_cut) -> None:
    hub.is_cut = is_cut
    if not is_cut:
        stop_half_way(hub)
    require_whole()
    assert hub.begins == [0, PIECE]


def stop_half_way(hub) -> None:
    hub.may_finish.clear()
    part = local_folder(MODEL) / f"{WEIGHTS}.part"
    with pytest.raises(Cancelled), stoppable(lambda: part.is_file() and part.stat().st_size >= PIECE):
        catalog.fetch(MODEL)
    assert not part.with_name("model.onnx").exists()
    hub.may_finish.set()


def test_other_bytes_than_the_hub_states_are_refused(hub) -> None:
    hub.files[WEIGHTS] = PUBLISHED[WEIGHTS][::-1]
    with pytest.raises(InputError, match=f"{WEIGHTS} is not what the hub states"):
        catalog.fetch(MODEL)
    assert not list(local_folder(MODEL).rglob("model.onnx*"))
    hub.files[WEIGHTS] = PUBLISHED[WEIGHTS]
    commit, hub.commit = hub.commit, "f" * 40
    with pytest.raises(InputError, match=rf"^{MODEL.title} cannot be downloaded \(404[^\n]*$"):
        catalog.fetch(MODEL)
    hub.commit = commit
    require_whole()
