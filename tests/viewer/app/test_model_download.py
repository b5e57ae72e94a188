"""A depth model is got in the window, from a hub on this machine, and used at once."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from iibr_core.depth.models.catalog import LOCK, cached_folder, known_model
from iibr_core.types import GridShape
from tests.iibr_core.depth.test_transformers_models import depth_anything
from tests.viewer.conftest import Driver, Opener
from viewer.model.commands import BY_NAME
from viewer.model.state.model_download import ModelsPrompt

COMMIT = "0123456789abcdef" * 2 + "01234567"
MODEL = known_model("depth-anything-v2-small")


class Hub(ThreadingHTTPServer):
    """As much of the hub as a download asks for: one model. may_finish: until then half of the weights are sent."""

    daemon_threads = True

    def __init__(self, folder: Path) -> None:
        super().__init__(("127.0.0.1", 0), Answer)
        self.files = {path.name: path.read_bytes() for path in folder.iterdir()}
        self.may_finish = threading.Event()


class Answer(BaseHTTPRequestHandler):
    """To one request."""

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_GET(self) -> None:
        hub: Any = self.server
        path = self.path.partition("?")[0]
        name = path.rpartition("/")[2]
        if path.startswith("/api/"):
            about = {"id": "a/b", "sha": COMMIT, "siblings": [{"rfilename": name} for name in hub.files]}
            tree = [{"type": "file", "path": name, "size": len(data), "oid": name} for name, data in hub.files.items()]
            body = json.dumps(tree if "/tree/" in path else about).encode()
        else:
            body = hub.files[name]
        self.send_response(200)
        for header in (("ETag", f'"{name}"'), ("X-Repo-Commit", COMMIT), ("Content-Length", str(len(body)))):
            self.send_header(*header)
        self.end_headers()
        if self.command == "GET":
            half = len(body) // 2 if name.endswith(".safetensors") else len(body)
            self.wfile.write(body[:half])
            if half < len(body):
                hub.may_finish.wait(60)
                self.wfile.write(body[half:])

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hub]:
    import huggingface_hub

    (tmp_path / "network").mkdir()
    with Hub(depth_anything(tmp_path / "network").folder) as server:
        threading.Thread(target=server.serve_forever).start()
        address = f"http://127.0.0.1:{server.server_address[1]}"
        # read once, at import: HF_ENDPOINT and HF_HOME come too late here
        monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", address)
        monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
        template = huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE.replace("https://huggingface.co", address)
        monkeypatch.setattr("huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE", template)
        monkeypatch.setattr(huggingface_hub.hf_api.api, "endpoint", address)
        yield server
        server.may_finish.set()
        server.shutdown()


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
    assert (folder / LOCK).is_file()
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
