"""A depth model is got in the window, from a hub on this machine, and used at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from iibr_core.depth.models.catalog import cached_folder, known_model
from iibr_core.depth.models.download import VERIFIED
from iibr_core.types import GridShape
from tests.iibr_core.depth.onnx_graphs import published
from tests.local_hub import Hub, local_hub
from tests.viewer.conftest import Driver, Opener
from viewer.model.commands import BY_NAME
from viewer.model.state.model_download import ModelsPrompt

MODEL = known_model("depth-anything-v2-small")


@pytest.fixture
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hub]:
    import huggingface_hub

    with local_hub(MODEL.commit, published(tmp_path / "network")) as server:
        server.may_finish.clear()
        address = server.address
        # read once, at import: HF_ENDPOINT and HF_HOME come too late here
        monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", address)
        monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
        template = huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE.replace("https://huggingface.co", address)
        monkeypatch.setattr("huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE", template)
        monkeypatch.setattr(huggingface_hub.hf_api.api, "endpoint", address)
        yield server


@pytest.fixture
def viewer(hub: Hub, open_window: Opener, photo_path: Path) -> Driver:
    """With the question on the screen, and the download begun."""
    driver = open_window(photo_path, grid=GridShape(1, 1))
    driver.until_idle()
    driver.app.do(BY_NAME["Get a depth model…"].action(driver.app.state))
    driver.until(lambda app: isinstance(app.state.prompt, ModelsPrompt))
    driver.until_idle()
    driver.press(f"Download {MODEL.megabytes} MB", "prompt ModelsPrompt")
    driver.until(lambda app: app.state.downloading is not None)
    assert driver.app.state.prompt is None
    return driver


def test_a_model_is_downloaded_and_used(viewer: Driver, hub: Hub) -> None:
    hub.may_finish.set()
    viewer.until(lambda app: app.state.downloading is None)
    folder = cached_folder(MODEL)
    assert folder is not None
    assert (folder / VERIFIED).is_file()
    assert viewer.app.state.source is not None
    assert viewer.app.state.source.depth.model == MODEL.name
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.source is app.state.source)
    origin = viewer.app.state.scene.depth_origin  # type: ignore[union-attr]
    assert origin is not None
    assert origin.kind == "model"


def test_a_download_can_be_given_up_and_goes_on_later(viewer: Driver, hub: Hub) -> None:
    before = viewer.app.state.source
    viewer.press("Cancel##download", "notices")
    viewer.until(lambda app: app.state.downloading is None)
    hub.may_finish.set()
    viewer.until_idle()
    viewer.app.close()
    assert cached_folder(MODEL) is None
    assert viewer.app.state.source is before
