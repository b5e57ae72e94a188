"""What inspection draws, without a window: seen where it belongs, in both themes, at every size of text."""

import numpy as np
import pytest

from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, GridShape, ViewOffset
from tests.viewer.conftest import HEIGHT, NEAR, WIDTH
from viewer.display.inspection_view import MASK_COLORS
from viewer.model import depth, inspection, lens, messages, viewpoint
from viewer.model.action import do
from viewer.model.depth import Brush, DepthSample
from viewer.model.inspection import Hover, beside_of
from viewer.model.layout import Zoom, layout_of
from viewer.model.messages import Notice
from viewer.model.window import layout_for
from viewer.ui.style import DARK

SIZE = 640, 1000
GRID = GridShape(3, 3)

HOVER = Hover(48.0, 32.0, 1.0)


OPEN_SECTIONS = ("inspect",)


def layout_now(viewer, size=SIZE):
    scale = viewer.state.preferences.font_scale
    return layout_of(size, (WIDTH, HEIGHT), ui_scale=scale, beside=beside_of(viewer.state))


def changed_after(viewer, *actions):
    before = viewer.screen(SIZE).astype(int)
    viewer.do(*actions)
    return np.abs(viewer.screen(SIZE) - before).max(axis=2) > 8


def part(screen, rect):
    top, left = round(rect.y), round(rect.x)
    return screen[top : top + round(rect.height), left : left + round(rect.width)]


def places_of(screen, color, tolerance=40):
    """(N, 2): rows and columns of the pixels of a colour of the marks."""
    return np.argwhere(np.abs(screen.astype(int) - np.multiply(color[:3], 255)).max(axis=2) < tolerance)


def test_the_inpainting_overlay_covers_what_the_photo_does_not_show(viewer):
    """The near square moves to the left, and shows what is behind its right."""
    viewer.do(do(lens.move_eye, ViewOffset(0, 1)))
    picture = layout_now(viewer).picture
    viewer.do(do(inspection.set_overlay, "inpainted"), do(inspection.set_opacity, 1.0))
    covered = part(viewer.screen(SIZE), picture).astype(int)[60:]
    amber = np.abs(covered - MASK_COLORS["inpainted"]).max(axis=2) < 24
    columns, scale = np.flatnonzero(amber.sum(axis=0) > 20), picture.width / WIDTH
    edge = (2 * WIDTH / 3 - NEAR) * scale
    assert edge - 2 < columns.min() <= columns.max() < edge + 4 * scale
    viewer.do(do(inspection.set_overlay, "entropy"))
    unsure = part(viewer.screen(SIZE), picture)[60:, round(edge) : round(edge + 2 * scale), 0]
    assert unsure.max() > 128, "viridis: only its light end is red"


@pytest.mark.parametrize("zoom", [None, Zoom(7.0, (0.45, 0.6))])
def test_photo_and_result_on_the_two_sides_of_the_divider(viewer, zoom):
    viewer.do(do(viewpoint.set_zoom, zoom), do(lens.move_eye, ViewOffset(0, 1)))
    seen = layout_for(viewer.state, SIZE, 1.0, 1.0).frame
    result = part(viewer.screen(SIZE), seen).astype(int)
    viewer.do(do(inspection.compare, "photo"), do(inspection.move_divider, 0.6))
    compared = part(viewer.screen(SIZE), seen).astype(int)
    viewer.do(do(inspection.compare, None), do(lens.move_eye, ViewOffset(0, 0)))
    photo = part(viewer.screen(SIZE), seen).astype(int)
    divider = round(0.6 * compared.shape[1])
    left, right = np.s_[60:, : divider - 20], np.s_[60:, divider + 20 :]
    assert np.abs(compared[right] - result[right]).max() <= 2
    assert np.median(np.abs(compared[left] - photo[left])) <= 2
    assert np.abs(compared[left] - result[left]).mean() > 2 * np.abs(compared[left] - photo[left]).mean()


def test_the_status_line_is_not_covered_by_notices(viewer):
    viewer.do(do(inspection.show_values, True), do(inspection.set_hover, HOVER))
    line = part(viewer.screen(SIZE), layout_now(viewer).status)
    assert line.std() > 5
    probe = viewer.state.inspection.probe
    assert probe.origin == "photo"
    assert probe.rgb[0] > probe.rgb[1] == probe.rgb[2], "the red square"
    viewer.do(do(messages.notify, Notice("a notice")))
    np.testing.assert_array_equal(part(viewer.screen(SIZE), layout_now(viewer).status), line)


def test_what_the_photo_does_not_show_is_told_as_inpainted(viewer):
    """Beside the square, in the middle row, from an eye that looks behind it."""
    viewer.do(do(inspection.show_values, True), do(lens.move_eye, ViewOffset(0, 1)))
    origins = set()
    for x in range(0, WIDTH, 2):
        disparity = viewer.pick(x, HEIGHT / 2)
        viewer.do(do(inspection.set_hover, Hover(x, HEIGHT / 2, disparity)))
        viewer.screen((400, 300))
        origins.add(viewer.state.inspection.probe.origin)
    assert origins == {"generated", "inpainted"}


def ring_after(viewer, *actions):
    """Return the middle and the size (down, across) of what appears over the picture, in pixels of the photo."""
    layout = layout_now(viewer)
    ring = np.argwhere(part(changed_after(viewer, *actions), layout.picture)) / layout.picture.width * WIDTH
    return (ring.min(axis=0) + ring.max(axis=0)) / 2, np.ptp(ring, axis=0)


@pytest.mark.parametrize("eye", [CENTRE, ViewOffset(0.6, -0.8)])
def test_the_ring_of_a_picked_depth_stays_on_its_surface(viewer, eye):
    """The place in the middle of the scene is picked: a surface that moves by 20 px a view step."""
    viewer.do(do(lens.move_eye, eye), do(depth.set_brush, Brush(tool="level", is_on=True)))
    picked = Brush(tool="level", is_on=True, sample=DepthSample((0.5, 0.5), 20.0))
    middle, _ = ring_after(viewer, do(depth.set_brush, picked))
    np.testing.assert_allclose(middle, (HEIGHT / 2 - 20 * eye.t, WIDTH / 2 - 20 * eye.s), atol=0.5)


def test_marks_in_an_epi_show_the_viewpoint_and_the_slope_of_the_surface(viewer):
    """A surface of disparity d is seen d px further left in the next view to the right."""
    hover = do(inspection.set_hover, Hover(40.0, 32.0, 4.0))
    viewer.do(do(inspection.show_epis, True), hover, do(lens.move_eye, ViewOffset(0, 0.5)))
    layout, screen = layout_now(viewer), viewer.screen(SIZE)
    strip = part(screen, layout.strip_across)
    px = layout.strip_across.width / WIDTH
    eye = places_of(strip, DARK.accent)
    assert eye[:, 0].mean() == pytest.approx(2 / 3 * strip.shape[0], abs=2)
    slope = places_of(strip, DARK.warning)
    first, last = (slope[np.abs(slope[:, 0] - row) <= 1][:, 1].mean() for row in (3, strip.shape[0] - 4))
    views = 3 * (strip.shape[0] - 7) / strip.shape[0]
    assert last - first == pytest.approx(-4.0 * px * views, abs=3)
    down = part(screen, layout.strip_down)
    assert places_of(down, DARK.accent)[:, 1].mean() == pytest.approx(down.shape[1] / 2, abs=2)


def test_a_zoomed_picture_has_its_own_values_strips_and_a_frame_on_the_minimap(viewer):
    viewer.do(do(inspection.show_values, True), do(inspection.show_epis, True))
    size = ScreenSize(1100, 900)
    fit = layout_for(viewer.state, size, 1.0, 1.0).fit
    viewer.do(do(viewpoint.set_zoom, Zoom(3 * fit, (0.7, 0.4))), do(inspection.set_hover, Hover(58.0, 26.0, None)))
    screen, layout = viewer.screen(size), layout_for(viewer.state, size, 1.0, 1.0)
    red, green, blue = viewer.state.inspection.probe.rgb
    assert red > green + 60 > blue, "the red square"
    seen, small = layout.part, part(screen, layout.minimap)
    frame = places_of(small, DARK.text, 25)
    share = np.array(small.shape[:2])
    np.testing.assert_allclose(frame.min(axis=0) / share, (seen.y, seen.x), atol=0.04)
    np.testing.assert_allclose(frame.max(axis=0) / share, (seen.y + seen.height, seen.x + seen.width), atol=0.04)
    strip, picture = part(screen, layout.strip_across).astype(int), part(screen, layout.frame).astype(int)
    row = round((26.5 / HEIGHT - seen.y) / seen.height * picture.shape[0])
    near = np.abs(strip[strip.shape[0] // 3 + 3] - picture[row]).max(axis=1)
    assert np.median(near) <= 6, "the strip shows the seen part"
    viewer.do(do(inspection.set_overlay, "disparity"), do(inspection.set_opacity, 1.0))
    near = part(viewer.screen(size), layout.frame)[row, :, 0] > 128  # viridis: only its light end is red
    right = (2 / 3 - seen.x) / seen.width
    assert np.flatnonzero(near).max() / near.size == pytest.approx(right, abs=0.02), "the square's right border"
    viewer.do(do(inspection.set_overlay, None), do(lens.set_exposure, -2.0), do(inspection.set_hover, None))
    dark = viewer.screen(size)
    for rect in (layout.minimap, layout.strip_across, layout.strip_down):
        assert np.median(part(dark, rect)) < 0.7 * np.median(part(screen, rect)), "as dark as the picture"
