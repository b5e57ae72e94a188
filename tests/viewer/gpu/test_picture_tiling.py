"""Pictures drawn in parts: nothing twice, nothing left out, no seams, and light beyond 8 bits."""

import numpy as np
import pytest

from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes, open_field
from viewer.gpu.refocus.picture_drawing import picture_tiles

GRID = GridShape(5, 5)
SCENE = TwoPlanes(width=160, height=120, background=-6.0, foreground=1.0, radius_px=25.0)
LARGE = 384, 256


CAT_EYE = ApertureShape("cat_eye", cat_eye=1.0)
OPTICS = [
    Optics(ViewOffset(0.3, -0.7)),
    Optics(ViewOffset(0.3, 0.2), focus_disparity=1.0, aperture_diameter=4.0),
    Optics(ViewOffset(0.0, 0.4), 1.5, -2.0, 0.0, (2.0, 1.0), 1.6, CAT_EYE),
]


def test_parts_have_no_seams(renderer, gl, monkeypatch):
    SCENE.fill(renderer, GRID)
    optics = OPTICS[2]
    whole = renderer.converged_picture(RenderSettings(optics, LARGE)).astype(int)
    monkeypatch.setattr(gl, "max_texture_size", 160)
    assert len(picture_tiles(LARGE, gl.max_texture_size)) == 6
    in_parts = renderer.converged_picture(RenderSettings(optics, LARGE))
    difference = np.abs(in_parts - whole).max(-1)
    assert np.mean(difference > 2) < 0.001, "rounding may decide a depth edge otherwise here and there"
    assert np.mean(difference) < 0.05


def test_the_converged_picture_is_what_refining_ends_at(renderer):
    SCENE.fill(renderer, GRID)
    for optics in OPTICS:
        renderer.render(optics, (160, 120))
        renderer.refine()
        assert np.array_equal(renderer.read_image(), renderer.converged_picture(RenderSettings(optics, (160, 120))))


@pytest.mark.parametrize(("optics", "is_linear"), list(zip(OPTICS[1:], (False, True))))
def test_a_picture_drawn_in_steps_is_the_one_drawn_at_once(renderer, gl, monkeypatch, optics, is_linear):
    SCENE.fill(renderer, GRID)
    settings = RenderSettings(optics, (192, 96), is_linear=is_linear)
    monkeypatch.setattr(gl, "max_texture_size", 160)
    assert len(picture_tiles(settings.size_px, gl.max_texture_size)) > 1
    at_once = renderer.converged_picture(settings)
    monkeypatch.setattr("viewer.gpu.refocus.picture_drawing.STEP_S", 1e-5)
    drawing = renderer.start_picture(settings)
    seen = [drawing.progress]
    while not drawing.is_done:
        drawing.advance(budget_s=0.0)
        seen.append(drawing.progress)
    assert len(seen) > 50, "a step is small"
    assert [0.0, *seen[1:-1], 1.0] == sorted(seen)
    np.testing.assert_array_equal(drawing.image, at_once)


def test_the_picture_on_the_screen_is_drawn_between_the_steps(renderer, monkeypatch):
    """Dragging while a picture is saved: neither disturbs the other."""
    SCENE.fill(renderer, GRID)
    monkeypatch.setattr("viewer.gpu.refocus.picture_drawing.STEP_S", 1e-4)
    saved, alone = Optics(ViewOffset(0.3, 0.2), aperture_diameter=4.0), []
    expected = renderer.converged_picture(RenderSettings(saved, (160, 120)))
    eyes = [Optics(ViewOffset(0.1 * i, -0.2), dolly=0.5, aperture_diameter=2.0) for i in range(3)]
    for optics in eyes:
        renderer.render(optics, (80, 60))
        alone.append(renderer.read_image())
    drawing = renderer.start_picture(RenderSettings(saved, (160, 120)))
    for optics, image in zip(eyes, alone):
        drawing.advance(budget_s=0.0)
        renderer.render(optics, (80, 60))
        np.testing.assert_array_equal(renderer.read_image(), image)
    assert not drawing.is_done
    drawing.advance()
    np.testing.assert_array_equal(drawing.image, expected)
    np.testing.assert_array_equal(renderer.read_image(), alone[-1])


@pytest.mark.parametrize("is_stopped", [False, True])
def test_another_field_changes_nothing_in_a_picture_that_is_being_drawn(renderer, is_stopped):
    """It holds the arrays that it is drawn from, until it is stopped."""
    SCENE.fill(renderer, GRID)
    settings = RenderSettings(Optics(aperture_diameter=4.0), (160, 120))
    drawing, field = renderer.start_picture(settings), renderer.field
    drawing.advance(budget_s=0.0)
    assert field.is_shared
    if is_stopped:
        for _ in range(2):
            drawing.stop()
        assert not field.is_shared
        drawing.advance()
        assert not drawing.is_done
        return
    expected = renderer.converged_picture(settings)
    open_field(renderer, GridShape(1, 1), 8, 8, with_disparity=False)
    assert not field.is_shared, "the drawing alone holds it"
    drawing.advance()
    drawing.stop()
    np.testing.assert_array_equal(drawing.image, expected)
