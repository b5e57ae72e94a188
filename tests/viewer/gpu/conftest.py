"""GL contexts for tests; every test that uses one must leave no GL error behind."""

import pytest

from viewer.gpu.context import create_headless
from viewer.gpu.refocus.picture_renderer import Renderer


@pytest.fixture(scope="module")
def module_gl():
    context = create_headless()
    yield context
    context.release()


@pytest.fixture
def gl(module_gl):
    assert module_gl.ctx.error == "GL_NO_ERROR", "left by an earlier test"
    yield module_gl
    assert module_gl.ctx.error == "GL_NO_ERROR"


@pytest.fixture
def renderer(gl):
    made = Renderer(gl)
    yield made
    made.release()
    if made.field is not None:
        made.field.release()
