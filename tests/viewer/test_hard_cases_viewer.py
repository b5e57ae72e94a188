"""Hard cases and faults seen from the viewer: each ends in a scene or in one line, and the viewer goes on.

See also test_preferences_store.py, gpu/test_light_field_texture.py and gpu/test_context.py.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from iibr_core.beyond.optics import CENTRE
from iibr_core.formats.images.open_picture import settings_text_in
from iibr_core.formats.images.picture_kinds import PictureFormat, is_float
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.write import write_light_field
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import SceneReady, SceneRequest, Source, ViewReady
from iibr_core.types import GridShape, InputError, ViewOffset, ViewUpdate
from tests.viewer.background.test_scene_worker import Desk
from tests.viewer.conftest import write_scene
from viewer.app.picture_files import export_picture, shot_of
from viewer.background.newest import Failed
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens
from viewer.model.action import do
from viewer.model.saved_settings import read_settings

GRID = GridShape(3, 3)


@contextmanager
def full_disk(room: int) -> Iterator[None]:
    """Files cannot grow beyond this many bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def desk() -> Iterator[Desk]:
    made = Desk()
    yield made
    made.thread.close()


def failure(desk: Desk, request: SceneRequest) -> str:
    """What the worker says of a job that must fail; then it carries out another."""
    desk.thread.submit(request)
    while not isinstance(result := desk.next(), Failed):
        assert not isinstance(result, SceneReady | ViewReady)
    assert "\n" not in result.message
    return result.message


def goes_on(desk: Desk, folder: Path, generation: int) -> None:
    """The worker makes a whole field of a good photo."""
    photo = write_scene(folder, "good")
    desk.thread.submit(SceneRequest(generation, Source(str(photo), grid=GridShape(1, 2))))
    while not (isinstance(result := desk.next(), ViewReady) and result.progress.done == 2):
        assert not isinstance(result, Failed)


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (Path.unlink, "no such file"),
        (lambda path: path.write_bytes(path.read_bytes()[:-40]), "cut off"),
    ],
    ids=["deleted", "cut off"],
)
def test_a_photo_that_went_bad_is_one_line_and_the_worker_goes_on(
    desk: Desk, tmp_path: Path, damage: Callable[[Path], None], reason: str
) -> None:
    photo = write_scene(tmp_path)
    damage(photo)
    message = failure(desk, SceneRequest(1, Source(str(photo))))
    assert "scene.png" in message
    assert reason in message
    goes_on(desk, tmp_path, 2)


def test_memory_that_runs_out_is_one_line_and_the_worker_goes_on(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An array that no machine has room for, in the midst of the views."""

    def exhaust(request: SceneRequest, eye: Callable[[], ViewOffset]) -> Iterator[SceneReady | ViewReady]:
        for result in results_of(request, eye):
            yield result
            np.zeros(1 << 56, np.uint8)

    with monkeypatch.context() as small:
        small.setattr("iibr_core.scenes.opening.results_of", exhaust)
        desk.thread.submit(SceneRequest(1, Source(str(write_scene(tmp_path)), grid=GRID)))
        while not isinstance(result := desk.next(), Failed):
            pass
    assert "MemoryError" in result.message
    assert "\n" not in result.message
    goes_on(desk, tmp_path, 2)


def test_a_view_deleted_while_the_light_field_opens(desk: Desk, tmp_path: Path) -> None:
    """The views that were read stay; the one that is gone is named."""
    views = (ViewUpdate(*at, np.full((8, 9, 3), 90, np.uint8), None) for at in np.ndindex(3, 3))
    write_light_field(tmp_path / "field", "hci", GRID, views, 50.0, "field")
    results = results_of(SceneRequest(1, Source(str(tmp_path / "field"))), lambda: CENTRE)
    assert isinstance(next(results), SceneReady)
    (tmp_path / "field" / "input_Cam008.png").unlink()
    seen = []
    with pytest.raises(InputError, match=r"input_Cam008\.png: no such file"):
        seen += list(results)
    message = failure(desk, SceneRequest(2, Source(str(tmp_path / "field"))))
    assert "input_Cam008.png: this view is missing" in message
    goes_on(desk, tmp_path, 3)


@pytest.mark.parametrize("size", [(1, 1), (5, 13)])
def test_photos_of_any_size_and_depth_become_scenes(tmp_path: Path, size: tuple[int, int]) -> None:
    """With a map of NaN, infinity, an outlier and negative values beside them."""
    random = np.random.default_rng(0)
    write_image(tmp_path / "a.png", random.integers(0, 256, (*size, 3), dtype=np.uint8))
    values = random.uniform(-3, 3, size).astype(np.float32)
    values.flat[: min(values.size - 1, 4)] = [np.nan, np.inf, 1e6, -np.inf][: values.size - 1]
    np.save(tmp_path / "a_disparity.npy", values)
    results = list(results_of(SceneRequest(1, Source(str(tmp_path / "a.png"), grid=GRID)), lambda: CENTRE))
    assert isinstance(results[0], SceneReady)
    views = [result.view for result in results if isinstance(result, ViewReady)]
    assert sum(view.is_final for view in views) == 9
    assert all(view.disparity is not None and np.isfinite(view.disparity).all() for view in views)


@pytest.fixture
def viewer(tmp_path: Path) -> Iterator[OffscreenScene]:
    with OffscreenScene("egl") as made:
        made.open(Source(str(write_scene(tmp_path)), grid=GRID))
        yield made


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_full_disk_while_a_picture_is_saved(viewer: OffscreenScene, tmp_path: Path, name: str) -> None:
    """One line, nothing half-written, what was there stays; with room again the same picture is saved."""
    path = tmp_path / name
    path.write_bytes(b"mine")
    form = PictureFormat()
    pixels, shot = viewer.picture((96, 64), is_float(path, form)), shot_of(viewer.state, (96, 64), form)
    others = set(tmp_path.iterdir())
    with full_disk(900), pytest.raises(InputError, match=f"{name}: cannot be written"):
        export_picture(path, pixels, shot)
    assert path.read_bytes() == b"mine"
    assert set(tmp_path.iterdir()) == others
    export_picture(path, pixels, shot)
    assert read_settings(path).size_px == (96, 64)


def test_the_photo_may_go_once_it_is_open(viewer: OffscreenScene, tmp_path: Path) -> None:
    before = viewer.picture()
    (tmp_path / "scene.png").unlink()
    (tmp_path / "scene_disparity.npy").unlink()
    viewer.do(do(lens.move_eye, ViewOffset(0.5, 0.5)), do(lens.set_aperture, 2.0))
    assert (viewer.picture() != before).any()
    with pytest.raises(InputError, match=r"scene\.png: no such file"):
        viewer.open(Source(str(tmp_path / "scene.png")))


def test_settings_that_are_no_text(tmp_path: Path) -> None:
    """Found by fuzzing: bytes that are no UTF-8 where the settings stand."""
    write_image(tmp_path / "a.exr", np.zeros((4, 4, 3), np.uint8), {"iibr:settings": "{some text}"})
    data = (tmp_path / "a.exr").read_bytes()
    assert settings_text_in(tmp_path / "a.exr") == "{some text}"
    (tmp_path / "a.exr").write_bytes(data.replace(b"{some text}", b"{\xff\xfe\xfd text}"))
    with pytest.raises(InputError, match=r"a\.exr: its settings are damaged"):
        read_settings(tmp_path / "a.exr")


def test_a_refused_gl_context_is_one_line(tmp_path: Path) -> None:
    """EGL without any driver."""
    photo, out = str(write_scene(tmp_path)), str(tmp_path / "o.png")
    command = [sys.executable, "-P", "-m", "viewer", "screenshot", photo, "--backend", "egl", "-o", out]
    nowhere = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent.json", "LIBGL_DRIVERS_PATH": "/nonexistent"}
    done = subprocess.run(command, env={**os.environ, **nowhere}, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    line = done.stderr.strip().splitlines()[-1]
    assert line.startswith("iibr: no OpenGL 3.3 without a display: egl")
    assert "(install libegl1" in line
    assert not (tmp_path / "o.png").exists()
