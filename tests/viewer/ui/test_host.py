"""The digest of a frame of ImGui: it is drawn again only when the digest changes."""

import pytest
from imgui_bundle import imgui

from iibr_core.scenes.screen_size import ScreenSize
from viewer.gpu.context import create_headless
from viewer.model.layout import layout_of
from viewer.ui.host import UiHost
from viewer.ui.style import Look


@pytest.fixture
def host():
    gl = create_headless()
    host = UiHost(Look())
    yield host
    host.release()
    gl.release()


def digest(host, layout, last_corner):
    """The digest of a frame with two triangles that share an edge; the very last index is given."""
    host.begin(layout, Look())
    lines = imgui.get_background_draw_list()
    lines.prim_reserve(6, 4)
    for corner in (0, 1, 2, 0, 2, last_corner):
        lines.prim_write_idx(corner)
    for x, y in ((0, 0), (9, 0), (9, 9), (0, 9)):
        lines.prim_write_vtx(imgui.ImVec2(x, y), imgui.get_font_tex_uv_white_pixel(), 0xFFFFFFFF)
    return host.end()


def test_the_last_index_counts(host):
    layout = layout_of(ScreenSize(640, 480), None)
    assert digest(host, layout, 3) == digest(host, layout, 3)
    assert digest(host, layout, 3) != digest(host, layout, 1)
