"""Hard cases and faults seen from the viewer: each ends in a scene or in one line, and the viewer goes on.

See also test_preferences_store.py, gpu/test_light_field_texture.py and gpu/test_context.py.
"""

import os
import subprocess
import sys

import numpy as np
import pytest

from iibr_core.formats.images.open_picture import settings_text_in
from iibr_core.formats.images.write import write_image
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import SceneRequest, Source, ViewReady
from iibr_core.types import GridShape, InputError
from tests.viewer.background.test_scene_worker import Desk
from tests.viewer.conftest import write_scene
from viewer.app.picture_files import read_settings
from viewer.background.newest import Failed

GRID = GridShape(3, 3)


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.thread.close()


def goes_on(desk, folder, generation):
    """The worker makes a whole field of a good photo."""
    photo = write_scene(folder, "good")
    desk.thread.submit(SceneRequest(generation, Source(str(photo), grid=GridShape(1, 2))))
    while not (isinstance(result := desk.next(), ViewReady) and result.progress.done == 2):
        assert not isinstance(result, Failed)


def test_memory_that_runs_out_is_one_line_and_the_worker_goes_on(desk, tmp_path, monkeypatch):
    """An array that no machine has room for, in the midst of the views."""

    def exhaust(request, eye):
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


def test_settings_that_are_no_text(tmp_path):
    """Found by fuzzing: bytes that are no UTF-8 where the settings stand."""
    write_image(tmp_path / "a.exr", np.zeros((4, 4, 3), np.uint8), {"iibr:settings": "{some text}"})
    data = (tmp_path / "a.exr").read_bytes()
    assert settings_text_in(tmp_path / "a.exr") == "{some text}"
    (tmp_path / "a.exr").write_bytes(data.replace(b"{some text}", b"{\xff\xfe\xfd text}"))
    with pytest.raises(InputError, match=r"a\.exr: its settings are damaged"):
        read_settings(tmp_path / "a.exr")


def test_a_refused_gl_context_is_one_line(tmp_path):
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
