"""Inspection as pure functions: verbs, layout beside the picture, words."""

from dataclasses import replace

from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape
from viewer.model import inspection
from viewer.model.app_state import AppState
from viewer.model.inspection import Hover, Probe
from viewer.model.preferences import Preferences
from viewer.ui.overlays.inspection_overlay import legend_words, status_text
from viewer.ui.overlays.reticle import hover_text

GRID = GridShape(5, 7)
PLAN = ScenePlan(GRID, 1.0, 0.0, (-1.0, 2.0), 0.1, True, 0, 0, ())
SCENE = Scene(Source("a.png"), "a", 60, 40, GRID, (-1.0, 2.0), "a.pfm", plan=PLAN)
FOLDER = replace(SCENE, plan=None)
OPEN = AppState(source=SCENE.source, scene=SCENE, generation=3)


def test_values_under_the_pointer_in_the_units_of_the_panel():
    numbers = replace(OPEN, preferences=Preferences(units="light field"))
    hover, probe = Hover(12.3, 4.0, -0.5), Probe((1, 20, 255), "inpainted")
    assert status_text(OPEN, SCENE, hover, None) == ["12, 4", hover_text(OPEN.optics, SCENE, hover)]
    assert "px" not in hover_text(OPEN.optics, SCENE, hover)
    words = ["12, 4", "−0.50 px", "0.50 behind", "inpainted", "RGB 1 20 255"]
    assert status_text(numbers, SCENE, hover, probe) == words
    assert status_text(OPEN, SCENE, replace(hover, disparity=None), probe) == ["12, 4", "inpainted", "RGB 1 20 255"]


def test_the_legend_speaks_the_units_of_the_panel():
    shown, ends = inspection.set_overlay(OPEN, "disparity"), (-1.5, 2.0)
    assert legend_words(shown, SCENE, ends) == ("distance", ["far", "near"])
    numbers = replace(shown, preferences=Preferences(units="light field"))
    assert legend_words(numbers, SCENE, ends) == ("px per step", ["−1.50", "2.00"])
    in_metres = replace(SCENE, inverse_metres=(0.1, 0.2))
    assert legend_words(shown, in_metres, ends) == ("distance", ["20 m", "2.50 m"])
    assert legend_words(inspection.set_overlay(OPEN, "entropy"), SCENE, (0.0, 1.0)) == ("entropy", ["0.00", "1.00"])
