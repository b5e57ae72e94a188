"""GL contexts and windows, as for the viewer's own tests."""

from tests.viewer.conftest import no_egl_context
from tests.viewer.gpu.conftest import gl, module_gl, renderer

__all__ = ["gl", "module_gl", "no_egl_context", "renderer"]
