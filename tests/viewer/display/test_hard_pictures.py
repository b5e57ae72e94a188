"""The window's picture area on a hard photo, in each way of looking, against golden pictures and values.

`pytest --regenerate-golden` writes them: look at them then.
"""

from pathlib import Path

import pytest

from iibr_core.beyond.optics import ApertureShape
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.golden_text import assert_same_text
from tests.image_compare import SAME_RASTERISER, assert_golden
from tests.viewer.display.hard_photo import write_hard_photo
from viewer.background.maps import SurfaceWork
from viewer.display.offscreen import OffscreenScene
from viewer.model import depth, inspection, lens, preferences, selection, viewpoint, window
from viewer.model.action import do
from viewer.model.depth import Brush
from viewer.model.inspection import Hover
from viewer.model.layout import Zoom
from viewer.model.window import layout_for

GOLDEN = Path(__file__).parents[2] / "golden" / "viewer"
SIZE = ScreenSize(330, 250)
AWAY = do(lens.move_eye, ViewOffset(-1.5, 1.25))
OPENED = (do(lens.set_aperture, 2.5), do(lens.set_focus, 0.4))
LOOKS = {
    "away": (AWAY, do(lens.set_dolly, 1.0), do(lens.set_exposure, 0.5)),
    "lens": (AWAY, *OPENED, do(lens.set_focus_tilt, (0.8, -0.3)), do(lens.set_aperture_shape, ApertureShape("ring"))),
    "glossy": (AWAY, do(lens.set_gloss, Gloss(roughness=0.4, reflectance=0.5)), do(lens.set_highlights, 1.0), *OPENED),
    "epis": (
        AWAY, do(inspection.set_hover, Hover(30.0, 47.0, 1.0)), do(inspection.show_epis, True),
        do(lens.set_exposure, -1.0), do(inspection.set_hover, None),
    ),
    "epis, zoomed": (
        do(inspection.show_epis, True), do(viewpoint.set_zoom, Zoom(3.0, (0.4, 0.45))), do(lens.set_exposure, 1.0),
        do(lens.move_eye, ViewOffset(1.0, -2.0)),
    ),
    "all views": (AWAY, do(inspection.show_views, True), do(lens.set_exposure, 0.5)),
    "depth": (AWAY, do(lens.set_dolly, -1.0), do(inspection.set_overlay, "disparity")),
    "depth under a brush": (
        do(inspection.set_opacity, 1.0), do(depth.set_brush, Brush(is_on=True)), do(viewpoint.set_zoom, Zoom(2.0)),
    ),
    "entropy": (AWAY, do(inspection.set_overlay, "entropy"), do(inspection.set_opacity, 1.0)),
    "inpainted": (AWAY, do(inspection.set_overlay, "inpainted"), do(viewpoint.set_zoom, Zoom(2.5, (0.3, 0.4)))),
    "snapshot": (
        AWAY, *OPENED, do(inspection.take_snapshot), do(lens.reset), do(inspection.compare, "snapshot"),
        do(viewpoint.set_zoom, Zoom(2.5, (0.4, 0.45))), do(inspection.move_divider, 0.45), do(window.end_gesture),
    ),
    "corner": (do(lens.move_eye, ViewOffset(1.0, 2.0)), do(inspection.set_overlay, "disparity")),
    "photo": (AWAY, do(lens.set_exposure, 1.0), do(inspection.compare, "photo")),
    "before": (AWAY, do(lens.set_exposure, 1.0), do(lens.show_before, True)),
    "selected": (AWAY, do(depth.set_brush, Brush("select", is_on=True)), do(selection.select, (0.5, 0.75))),
}  # fmt: skip
WITH_VALUES = "away", "corner", "epis, zoomed", "inpainted"
POINTERS = [(x, y) for y in (12.0, 24.5, 47.3) for x in (-1.0, 8.0, 22.6, 33.0, 52.4, 90.0)]


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    with OffscreenScene("egl") as viewer:
        viewer.open(write_hard_photo(tmp_path_factory.mktemp("hard")))
        viewer.do(do(preferences.place_window, None))
        yield viewer


def look(viewer, name):
    viewer.do(do(window.set_narrow, True), *LOOKS[name])
    if (request := viewer.inspection.surface_request(viewer.state)) is not None:
        SurfaceWork()(request, lambda surface: viewer.do(*viewer.inspection.take_surface(surface)))


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    """Few passes: how a picture converges is tested in tests/viewer/gpu."""
    monkeypatch.setattr("viewer.gpu.refocus.picture_lens.EDGE_PASSES", 2)


def values(viewer, name):
    """Yield the values at each place of the pointer."""
    viewer.do(do(inspection.show_values, True))
    yield f"part {tuple(round(each, 3) for each in layout_for(viewer.state, SIZE, 1.0, 1.0).part)}"
    for x, y in POINTERS:
        viewer.do(do(inspection.set_hover, Hover(x, y, viewer.pick(x, y))))
        probe = viewer.inspection.probe(viewer.state)
        rgb = " ".join(f"{value / 10:.1f}" for value in probe.rgb)
        yield f"{x:.1f}, {y:.1f}: {viewer.state.hover.disparity:.2f} px, {probe.origin}, {rgb}"


@pytest.mark.parametrize("name", LOOKS)
def test_each_way_of_looking_is_the_golden_one(viewer, name, tmp_path, regenerate_golden):
    look(viewer, name)
    file = f"viewer/{name.replace(', ', '-').replace(' ', '-')}"
    assert_golden(viewer.screen(SIZE), file, SAME_RASTERISER, tmp_path, regenerate_golden)
    if name in WITH_VALUES:
        lines = list(values(viewer, name))
        assert_same_text(lines, "viewer/values", name, regenerate_golden, atol=0.3, rtol=0.0)
