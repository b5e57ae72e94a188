import math
from dataclasses import replace

import pytest

from iibr_core.rendering.gloss.gloss_settings import Gloss, GlossLight, GlossStroke, GlossSurface, require_sound
from iibr_core.types import InputError


def test_the_usual_gloss_is_sound():
    require_sound(Gloss())


@pytest.mark.parametrize(
    ("gloss", "named"),
    [
        (Gloss(roughness=math.nan), "roughness"),
        (Gloss(roughness=-0.1), "roughness"),
        (Gloss(reflectance=1.5), "reflectance"),
        (Gloss(light=GlossLight(direction=(0, 0, 0))), "light.direction"),
        (Gloss(light=GlossLight(direction=(0, math.nan, 1))), "light.direction"),
        (Gloss(light=GlossLight(color=(1, math.inf, 1))), "light.color"),
        (Gloss(light=GlossLight(radius_deg=0)), "light.radius_deg"),
        (Gloss(GlossSurface(farthest=0.8, nearest=0.2)), "surface.nearest"),
        (Gloss(GlossSurface(color=(0, 0, 2))), "surface.color"),
        (Gloss(GlossSurface(strokes=(GlossStroke((), 0.1),))), "0 points"),
        (Gloss(GlossSurface(strokes=(GlossStroke(((0.5, math.nan),), 0.1),))), "points"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(gloss, named):
    with pytest.raises(InputError, match=named):
        require_sound(gloss)


def test_a_smaller_light_of_the_same_strength_is_brighter():
    wide = GlossLight(radius_deg=4.0)
    narrow = replace(wide, radius_deg=2.0)
    assert narrow.radiance[0] == pytest.approx(4 * wide.radiance[0], rel=0.01)
