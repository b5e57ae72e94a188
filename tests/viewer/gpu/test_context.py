"""Contexts without a window: all kinds in one process, without loading what opens windows."""

import subprocess
import sys
from pathlib import Path

from tests.viewer.gpu.test_golden_optics import check, drawn, require_llvmpipe
from viewer.gpu.context import create_headless, usual_backends
from viewer.gpu.refocus.picture_renderer import Renderer


def test_contexts_come_and_go_in_one_process():
    backends = ["egl", "osmesa", "auto"]
    for backend in backends:
        gl = create_headless(backend)
        assert backend in (gl.backend, "auto")
        target = gl.ctx.simple_framebuffer((4, 4))
        target.clear(1.0, 0.0, 0.0, 1.0)
        assert target.read()[:3] == b"\xff\x00\x00"
        assert gl.ctx.error == "GL_NO_ERROR"
        target.release()
        gl.release()
        gl.release()


def test_other_systems_have_one_backend():
    """The library knows it: naming EGL there can only fail."""
    assert usual_backends("linux") == ("egl", "osmesa")
    assert usual_backends("darwin") == usual_backends("win32") == ("system",)


def test_pictures_without_a_window_load_no_window_library():
    """They take their time before the first picture."""
    code = (
        "import sys\n"
        "from viewer.display.offscreen import OffscreenScene\n"
        "OffscreenScene('egl')\n"
        "loaded = {'glfw', 'imgui_bundle', 'torch'} & set(sys.modules)\n"
        "assert not loaded, loaded\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parents[3])


def test_a_context_without_egl_draws_the_same(tmp_path):
    gl = create_headless("osmesa")
    renderer = Renderer(gl)
    require_llvmpipe(renderer)
    check("all", drawn(renderer, "all"), tmp_path, False)
    renderer.field.release()
    renderer.release()
    gl.release()
