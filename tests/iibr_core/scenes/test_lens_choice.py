from typing import Any

import numpy as np
import pytest

from iibr_core.beyond.optics import HIGHLIGHT_GAIN, ApertureMask, ApertureShape, Optics
from iibr_core.scenes.f_numbers import equivalent_f_number, f_number
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import Scene, SceneReady, SceneRequest, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, GridShape, InputError

SCENE = Scene(Source("a.png"), "a", 96, 64, GridShape(5, 9), (-1.0, 2.0), "file", own_size=ScreenSize(960, 640))
DISPARITY = np.linspace(-1, 2, 64 * 96, dtype=np.float32).reshape(64, 96)
POLYGON = ApertureShape("polygon", blades=7, rotation_deg=10.0)
MASK = ApertureMask("dot", 1, 1, bytes([255]))

WRONG: dict[str, dict[str, Any]] = {
    "focus and focus at": {"focus": 1.0, "focus_at": (1.0, 1.0)},
    "aperture and f-number": {"aperture": 1.0, "f_number": 2.0},
    "give one of them": {"blades": 5, "ring": 0.5},
    "blades 12: give 3 to 11": {"blades": 12},
    "ring 1: give 0 to 0.95": {"ring": 1.0},
    "cat's eye 1.5": {"cat_eye": 1.5},
    "highlights -1": {"highlights": -1.0},
    "f-number 0: give 0.1 or more": {"f_number": 0.0},
    "aperture nan": {"aperture": float("nan")},
    "finite": {"tilt": (0.0, float("inf"))},
    "rotation 30: turns blades or a mask": {"rotation": 30.0},
    "turns blades or a mask": {"rotation": 30.0, "cat_eye": 0.5},
    "roundness 0.5: bends": {"roundness": 0.5, "mask": MASK},
    "960,3: lies outside": {"focus_at": (960.0, 3.0)},
}


@pytest.mark.parametrize("named", WRONG)
def test_choices_that_cannot_be_met_are_refused_in_one_line(named):
    with pytest.raises(InputError) as refusal:
        LensChoice(**WRONG[named]).optics_on(SCENE, DISPARITY)
    assert named in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_place_far_from_the_centre_is_in_focus():
    """In pixels of the photo, which has ten times the views' pixels across."""
    assert LensChoice(focus_at=(959.0, 0.0)).optics_on(SCENE, DISPARITY).focus_disparity == DISPARITY[0, 95]
    assert LensChoice(focus_at=(15.0, 639.0)).optics_on(SCENE, DISPARITY).focus_disparity == DISPARITY[63, 1]
    with pytest.raises(InputError, match="has no depth"):
        LensChoice(focus_at=(1.0, 1.0)).optics_on(SCENE)


def test_an_f_number_is_the_one_that_is_shown(photo_path):
    ready = next(results_of(SceneRequest(1, Source(str(photo_path))), lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    for scene in (ready.scene, SCENE):
        diameter = LensChoice(f_number=8.0).optics_on(scene).aperture_diameter
        assert (f_number(scene, diameter) or equivalent_f_number(scene, diameter)) == pytest.approx(8.0)


def test_shapes_change_what_is_chosen_alone():
    """As after the settings of a saved picture."""
    saved = Optics(aperture_diameter=2.0, aperture_shape=POLYGON)
    shape = LensChoice(rotation=30.0, roundness=0.5).optics_on(SCENE, None, saved).aperture_shape
    assert shape == ApertureShape("polygon", blades=7, rotation_deg=30.0, roundness=0.5)
    assert LensChoice(ring=0.3).optics_on(SCENE, None, saved).aperture_shape.kind == "ring"
    assert LensChoice(mask=MASK, rotation=5.0).shape_on(POLYGON).mask == MASK


def test_highlights_are_stops_above_white():
    for stops, factor in ((0.0, 1.0), (1.5, 2**1.5), (4.0, 16.0)):
        optics = LensChoice(highlights=stops, aperture=3.0).optics_on(SCENE)
        assert 1 + HIGHLIGHT_GAIN * optics.highlight_recovery == pytest.approx(factor)


def test_choices_without_effect_are_noted():
    closed, opened = Optics(), Optics(aperture_diameter=1.0)
    assert "nothing of shape and highlights;" in LensChoice(blades=5, highlights=1.0).notes(closed, SCENE)[0]
    assert LensChoice(blades=5, highlights=1.0).notes(opened, SCENE) == ()
    assert LensChoice(focus=1.0).notes(closed, SCENE) == ()
