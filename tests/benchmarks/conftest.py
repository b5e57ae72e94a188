"""GL contexts, as for the viewer's own tests."""

from tests.viewer.gpu.conftest import gl, module_gl, renderer

__all__ = ["gl", "module_gl", "renderer"]
