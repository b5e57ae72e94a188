"""Gloss as it is drawn live, against the core's views with gloss."""

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.settings import Gloss, GlossLight, GlossSurface
from iibr_core.gloss.shading import make_gloss_maps, shade
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import open_field, open_views, rms

GRID = GridShape(3, 3)
WIDTH, HEIGHT = 96, 72
LIT = Gloss(roughness=0.4, reflectance=0.3, light=GlossLight((0.1, -0.1, -1), (0.5, 0.4, 0.3)))
METAL = Gloss(GlossSurface(), 0.2, 0.6, GlossLight((0.3, -0.2, -1)))
SHARE = Gloss(GlossSurface(color=(0.55, 0.55, 0.55)), 0.2, 0.6, GlossLight((0.3, -0.2, -1)))
"""Only about half of what the photo's grey reflects, as its colour is at the edge of the tolerance."""


def bump():
    """Disparity (H, W) of a smooth hill."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return (1 + 1.5 * np.exp(-(((x - 48) / 30) ** 2) - ((y - 36) / 25) ** 2)).astype(np.float32)


def maps_of(gloss, photo, disparity, infinity=-1.0):
    return make_gloss_maps(gloss.surface, (photo / 255).astype(np.float32), disparity, SceneGeometry(100.0, infinity))


def open_flat(renderer, gloss):
    """A flat grey field with gloss, its photo and its maps."""
    photo, flat = np.full((HEIGHT, WIDTH, 3), 100, np.uint8), np.full((HEIGHT, WIDTH), 2.0, np.float32)
    open_views(renderer, GRID, photo, flat)
    maps = maps_of(gloss, photo, flat)
    renderer.field.set_gloss(maps)
    return photo, maps


def shaded(gloss, maps, photo, eye):
    colors = (photo / 255).astype(np.float32)
    shade(colors, maps.disparity, eye, gloss, maps)
    return np.rint(np.clip(colors, 0, 1) * 255).astype(np.uint8)


@pytest.mark.parametrize("infinity", [-1.0, 1.6], ids=["all nearer than infinity", "some beyond infinity"])
@pytest.mark.parametrize("gloss", [LIT, METAL, SHARE], ids=["lit", "metal", "half of it"])
def test_the_photo_with_gloss_is_the_cores(renderer, gloss, infinity):
    photo, disparity = np.full((HEIGHT, WIDTH, 3), 100, np.uint8), bump()
    maps = maps_of(gloss, photo, disparity, infinity)
    open_field(renderer, GRID, WIDTH, HEIGHT)
    renderer.field.upload(1, 1, photo, disparity)
    renderer.field.set_gloss(maps)
    renderer.render(Optics(gloss=gloss), (WIDTH, HEIGHT))
    expected = shaded(gloss, maps, photo, ViewOffset(0.0, 0.0))
    assert rms(expected, photo) > 0.02
    assert rms(renderer.read_image(), expected) < 0.004


@pytest.mark.parametrize("row_step", [1.0, 0.4])
@pytest.mark.parametrize(("gloss", "eye"), [(LIT, ViewOffset(0.5, -0.5)), (METAL, ViewOffset(-1.0, 1.0))])
def test_other_viewpoints_are_the_cores_too(renderer, gloss, eye, row_step):
    photo, maps = open_flat(renderer, gloss)
    renderer.field.row_step = row_step
    renderer.render(Optics(eye=eye, gloss=gloss), (WIDTH, HEIGHT))
    assert rms(renderer.read_image(), shaded(gloss, maps, photo, ViewOffset(row_step * eye.t, eye.s))) < 0.006
