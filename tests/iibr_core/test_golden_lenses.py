"""Pictures through lenses, apertures and gloss of hard scenes as small pictures.

`pytest --regenerate-golden` writes them; then look at them.
"""

import numpy as np
import pytest

import iibr_core as iibr
from iibr_core.beyond.aperture_sampling import aperture_points, grid_weights, views_in_aperture
from iibr_core.beyond.aperture_shape import openness
from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.lens_slices import slices_of
from iibr_core.beyond.optics import ApertureMask, ApertureShape, Optics
from iibr_core.color import encoded_from_stored, srgb_from_linear
from iibr_core.formats.images.write import write_image
from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.settings import Gloss, GlossLight, GlossStroke, GlossSurface
from iibr_core.gloss.shading import make_gloss_maps, shade_views
from iibr_core.types import CENTRE, GridShape, ImageSize, ViewOffset, ViewUpdate
from tests.iibr_core.golden_scene import (
    GRID,
    HEIGHT,
    WIDTH,
    assert_golden_pictures,
    grey,
    hard_field,
    hard_scene,
    with_maps,
)
from tests.iibr_core.unequal_rows import write_unequal_rows

ARROW = np.array([[0, 255, 0, 0], [255, 255, 255, 0], [0, 255, 0, 120]], np.uint8)


def through_lenses(is_hdr, *choices):
    """Return pictures of a photo through lenses. choices: options of `refocus`."""
    return lambda _: [hard_field(is_hdr).refocus(cameras=24, **choice) for choice in choices]


def through_a_mask(folder):
    write_image(folder / "arrow.png", ARROW)
    chosen = dict(mask=folder / "arrow.png", rotation=35.0, tilt=(0.0, 1.5))
    return [hard_field().refocus(3.0, 2.8, cameras=40, **chosen)]


def of_stored_views(folder):
    """Return pictures of stored views of uneven rows through lenses, and views between them; their depth is found."""
    write_image(folder / "arrow.png", ARROW)
    scene = iibr.open(write_unequal_rows(folder / "field"))
    whole, dense, part = scene.light_field(), scene.light_field((9, 9)), np.s_[20:76, 16:80]
    masked = whole.refocus(3.0, 3.4, mask=folder / "arrow.png", rotation=35.0, tilt=(0.0, 1.5))
    ring = dense.refocus(focus_range=0.4, aperture=5.0, ring=0.6, focus=0.2, highlights=3.0)
    between = [with_maps(*(each[at][part] for each in (dense.views, dense.disparity, dense.inpainted)))
               for at in ((3, 5), (7, 1))]  # fmt: skip
    return [np.concatenate([masked[part], ring[part]], axis=1), *between]


def summed_up(_):
    """Return sums of stored views as a lens off the middle sees them, of an ordinary and an HDR photo."""
    optics = Optics(
        ViewOffset(-0.6, 0.8), focus_disparity=-2.5, focus_range=1.2, focus_tilt=(-1.0, 0.7), aperture_diameter=3.1,
        aperture_shape=ApertureShape("cat_eye", cat_eye=0.7), highlight_recovery=0.08, exposure_stops=-0.8,
    ).with_focus_scaled(-0.9)  # fmt: skip
    pictures = []
    for whole in (hard_field(), hard_field(True)):
        lens = LensSum(optics, ImageSize(HEIGHT, WIDTH), whole.views.dtype == np.float16)
        for at in np.ndindex(*GRID):
            colors = encoded_from_stored(whole.views[at])
            lens.add(GRID.offset(*at), colors, 0.5 + 0.1 * at[0] + 0.2 * at[1], whole.disparity[at])
        pictures.append(srgb_from_linear(lens.light()))
    return pictures


SHAPES = [
    ApertureShape("polygon", blades=5, rotation_deg=25.0),
    ApertureShape("polygon", blades=3, rotation_deg=-10.0, roundness=0.4),
    ApertureShape("ring", ring_inner=0.35),
    ApertureShape("mask", mask=ApertureMask("arrow", *ARROW.shape, ARROW.tobytes()), rotation_deg=30.0),
]


def apertures(_):
    """Return openings cut off by a grid, the views that they weigh, their cameras, and discs of two sizes."""
    t, s = np.meshgrid(*[np.linspace(-1.6, 1.6, 48)] * 2, indexing="ij")
    pictures = []
    for shape in SHAPES:
        weights = views_in_aperture(shape, 2.9, ViewOffset(0.4, -0.7), GridShape(4, 6))
        tiles = [openness(shape, t, s, 3.0, 2.4, 0.1), np.kron(weights / weights.max(), np.ones((12, 8)))]
        drawn = [(15 * aperture_points(shape, 3.0, 2.4, 20), None)]
        drawn += [
            (each.taps[:, 1::-1], each.taps[:, 2]) for each in slices_of(np.array([-7.0, 31.0, 50.0, 0.2]), shape)
        ]
        for points, shares in drawn:
            tile = grid_weights(points, CENTRE, GridShape(48, 48), shares)
            tiles.append(0.3 + 0.7 * tile / tile.max())
        pictures.append(grey(np.concatenate(tiles, axis=1), 0, 1))
    return pictures


GLOSSES = {
    "varnish": Gloss(
        GlossSurface(0.02, 0.6, strokes=(GlossStroke(((0.2, 0.35), (0.9, 0.3)), 0.06, erases=True),)),
        0.35, 0.06, GlossLight((-0.15, 0.12, -1.0), (1.0, 0.8, 0.5), 6.0),
    ),
    "metal": Gloss(
        GlossSurface(color=(0.8, 0.25, 0.2), tolerance=0.3), 0.6, 0.7, GlossLight((0.1, 0.5, -1.0), radius_deg=20.0)
    ),
    "strokes": Gloss(
        GlossSurface(strokes=(GlossStroke(((0.9, 0.2), (0.85, 0.6)), 0.09), GlossStroke(((0.1, 0.9),), 0.12)),
                     strokes_only=True),
        0.15, 0.3, GlossLight((-0.8, 0.1, -0.3), (0.2, 0.5, 1.0), 12.0),
    ),
}  # fmt: skip


def glossy(name):
    """Return views beside the middle with gloss, ordinary and HDR, and the surface and its normals."""
    gloss, (photo, disparity), pictures = GLOSSES[name], hard_scene(), []
    geometry = SceneGeometry(95.0, 0.1 if name == "varnish" else -2.5)  # some of the wall is farther than infinity
    maps = make_gloss_maps(gloss.surface, photo, disparity, geometry)
    for whole, at in ((hard_field(), (0, 4)), (hard_field(True), (3, 1))):
        given = ViewUpdate(*at, whole.views[at], whole.disparity[at], whole.inpainted[at])
        (view,) = shade_views(iter([given]), gloss, maps, GRID.offset)
        pictures.append(encoded_from_stored(view.colors) / (1 if view.colors.dtype == np.uint8 else 1.5))
    return [np.concatenate(pictures, axis=1), np.concatenate([grey(maps.mask, 0, 1), 0.5 - 0.5 * maps.normals], axis=1)]


PICTURES = {
    "lens-polygon": through_lenses(
        False, dict(focus=3.0, aperture=1.8, blades=5, roundness=0.4, rotation=20.0, highlights=3.0),
        dict(at=(70.0, 20.0), f_number=0.4, blades=3, rotation=-40.0),
    ),
    "lens-ring": through_lenses(False, dict(focus=0.0, aperture=2.6, ring=0.6, tilt=(2.0, -1.0), highlights=2.0)),
    "lens-range": through_lenses(False, dict(focus=0.5, aperture=3.0, focus_range=1.5, cat_eye=0.9, tilt=(0.0, 1.0))),
    "lens-hdr": through_lenses(True, dict(focus=5.0, aperture=2.2, cat_eye=0.5), dict(focus=3.0)),
    "lens-mask": through_a_mask,
    "lens-stored-views": of_stored_views,
    "lens-sum": summed_up,
    "apertures": apertures,
    **{f"gloss-{name}": lambda _, name=name: glossy(name) for name in GLOSSES},
}  # fmt: skip


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_the_golden_ones(name, tmp_path, regenerate_golden):
    assert_golden_pictures(PICTURES[name](tmp_path), name, tmp_path, regenerate_golden)
