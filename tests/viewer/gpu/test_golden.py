"""Golden images, on one software rasteriser, through EGL and OSMesa alike. `pytest --regenerate-golden` writes them."""

from pathlib import Path

import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.types import GridShape, ViewOffset
from tests.image_compare import SAME_RASTERISER, assert_close, read_png, write_png
from tests.viewer.gpu.scenes import TwoPlanes
from viewer.gpu.context import create_headless
from viewer.gpu.refocus.picture_renderer import Renderer

GOLDEN = Path(__file__).parents[2] / "golden"
GRID = GridShape(5, 5)
SCENE = TwoPlanes(width=160, height=120, background=-4.0, foreground=3.0, radius_px=30.0)
EVERY_VIEW = list(range(25))
PICTURES = {
    "preview": ([12], Optics(ViewOffset(1.0, -1.5))),
    "between-views": (EVERY_VIEW, Optics(ViewOffset(0.5, -1.5))),
    "front-in-focus": (EVERY_VIEW, Optics(focus_disparity=3.0, aperture_diameter=4.0)),
    "background-in-focus": (
        EVERY_VIEW,
        Optics(ViewOffset(0.3, 0.0), focus_disparity=-4.0, aperture_diameter=4.0, exposure_stops=-0.5),
    ),
    "small-aperture": (EVERY_VIEW, Optics(ViewOffset(0.5, 0.5), focus_disparity=-4.0, aperture_diameter=1.4)),
    "half-filled": ([12, 0, 4, 20, 24], Optics(focus_disparity=3.0, aperture_diameter=4.0)),
}


@pytest.mark.parametrize("backend", ["egl", "osmesa"])
def test_pictures_are_the_golden_ones(backend, tmp_path, regenerate_golden):
    gl = create_headless(backend)
    if "llvmpipe" not in gl.renderer:
        gl.release()
        pytest.skip(f"golden images belong to llvmpipe, this is {gl.renderer}")
    renderer = Renderer(gl)
    images = {name: drawn(renderer, *picture) for name, picture in PICTURES.items()}
    assert gl.ctx.error == "GL_NO_ERROR"
    renderer.release()
    gl.release()
    for name, image in images.items():
        file = GOLDEN / f"{name}.png"
        if regenerate_golden and backend == "egl":
            write_png(file, image)
        assert_close(image, read_png(file), SAME_RASTERISER, tmp_path, name)


def drawn(renderer, views, optics):
    SCENE.fill(renderer, GRID)
    if views != EVERY_VIEW:  # the surface behind the photo's is not known yet
        SCENE.open(renderer, GRID)
        for index in views:
            SCENE.upload(renderer, GRID, *divmod(index, GRID.columns))
    renderer.render(optics, (SCENE.width, SCENE.height))
    return renderer.read_image()
