"""Each control of the panel: what a person sets is what the state gets, in the units that are shown."""

from dataclasses import replace
from operator import attrgetter

import pytest

from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.exports.kinds import ExportOptions
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape
from tests.viewer.conftest import reduce
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from viewer.model import depth, inspection, lens, messages, viewpoint
from viewer.model.action import do
from viewer.model.depth import Brush, DepthSample
from viewer.model.lens import FIRST_GLOSS, GlossBrush
from viewer.model.preferences import Preferences, with_sections
from viewer.model.saving import ExportPrompt, SavePrompt

NINE = GridShape(9, 9)
SCENE = scene_of(NINE, plan=plan_of(NINE), focal_px=50.0)
"""Disparity from -2 to 3: the focus goes from -2.5 to 3.5, the aperture to 9 view steps, the eyes to 8."""


def state_of(section, *actions, units="photographic", scene=SCENE):
    opened = Preferences(open_sections=with_sections((), section), units=units)
    state = replace(state_with(scene), preferences=opened, hides_panel=False)
    for action in actions:
        state = reduce(state, action)
    return state


SHAPE = do(lens.set_aperture_shape, replace(state_of("more").optics.aperture_shape, kind="polygon"))
RING, CAT = (do(lens.set_aperture_shape, replace(SHAPE.args[0], kind=kind)) for kind in ("ring", "cat_eye"))
WARM = replace(FIRST_GLOSS.light, color=(0.5, 0.25, 0.25))
GLOSSY = do(lens.set_gloss, replace(FIRST_GLOSS, light=WARM, surface=replace(FIRST_GLOSS.surface, nearest=0.4)))
GLOSS_BRUSH = do(lens.take_gloss_brush, GlossBrush(is_on=True))
BRUSH, BUCKET, LEVEL = (
    do(depth.set_brush, Brush(tool, is_on=True, sample=DepthSample((0.5, 0.5), 1.0)))
    for tool in ("nearer", "fill", "level")
)
STROKE = do(lens.paint_gloss, (0.5, 0.5), GlossBrush(), True)
SLIDERS = [
    ("more", (), "##Focus", 25.0, "optics.focus_disparity", 2.0),
    ("more", (), "##Aperture", 5.0, "optics.aperture_diameter", 4.5),
    ("more", (), "##Depth strength", 2.0, "depth_strength", 2.0),
    ("view", (), "##Speed", 8.0, "motion.speed", 0.125),
    ("view", (), "##Dolly", -50.0, "optics.dolly", -2.0),
    ("focus", (), "##Range", 10.0, "optics.focus_range", 0.6),
    ("focus", (), "##Tilt right", 50.0, "optics.focus_tilt", (3.0, 0.0)),
    ("focus", (), "##Tilt down", -50.0, "optics.focus_tilt", (0.0, -3.0)),
    ("aperture", (SHAPE,), "##Blades", 7.0, "optics.aperture_shape.blades", 7),
    ("aperture", (SHAPE,), "##Rotation", 90.0, "optics.aperture_shape.rotation_deg", 90.0),
    ("aperture", (RING,), "##Blocked", 0.25, "optics.aperture_shape.ring_inner", 0.25),
    ("aperture", (CAT,), "##Cut off", 0.25, "optics.aperture_shape.cat_eye", 0.25),
    ("light", (), "##Exposure", -1.5, "optics.exposure_stops", -1.5),
    ("light", (), "##Highlights", 40.0, "optics.highlight_recovery", 0.4),
    ("gloss", (GLOSSY,), "##Roughness", 60.0, "optics.gloss.roughness", 0.6),
    ("gloss", (GLOSSY,), "##Reflects", 60.0, "optics.gloss.reflectance", 0.6),
    ("gloss", (GLOSSY,), "##Brightness", 2.0, "optics.gloss.light.color", (2.0, 1.0, 1.0)),
    ("gloss", (GLOSSY,), "##Light size", 3.0, "optics.gloss.light.radius_deg", 3.0),
    ("gloss", (GLOSSY,), "##From far", 60.0, "optics.gloss.surface.nearest", 0.6),
    ("gloss", (GLOSSY,), "##To near", 30.0, "optics.gloss.surface.nearest", 0.3),
    ("gloss", (GLOSSY, GLOSS_BRUSH), "##Brush size", 9.0, "gloss_brush.radius", 0.09),
    ("depth", (), "##Far clip", 0.2, "depth.edits.far_clip", 0.2),
    ("depth", (), "##Near clip", 0.7, "depth.edits.near_clip", 0.7),
    ("depth", (), "##Gamma", 2.0, "depth.edits.gamma", 2.0),
    ("depth", (BRUSH,), "##Size", 9.0, "brush.radius", 0.09),
    ("depth", (BRUSH,), "##Strength", 30.0, "brush.strength", 0.3),
    ("depth", (BUCKET,), "##Tolerance", 150.0, "brush.tolerance", 1.5),
    ("stereo display", (), "##Eye distance", 6.0, "stereo.eyes", 1.2),
    ("stereo display", (), "##Screen plane", 20.0, "stereo.screen", 2.0),
    ("inspect", (do(inspection.set_overlay, "disparity"),), "##Opacity", 30.0, "inspection.opacity", 0.3),
]  # fmt: skip
IN_PIXELS = [
    ("more", (), "##Focus", 1.5, "optics.focus_disparity", 1.5),
    ("more", (), "##Aperture", 2.5, "optics.aperture_diameter", 2.5),
    ("view", (), "##Dolly", 1.5, "optics.dolly", 1.5),
    ("focus", (), "##Range", 0.5, "optics.focus_range", 0.5),
    ("focus", (), "##Tilt right", 0.5, "optics.focus_tilt", (0.5, 0.0)),
    ("stereo display", (), "##Eye distance", 1.5, "stereo.eyes", 1.5),
    ("stereo display", (), "##Screen plane", 1.5, "stereo.screen", 1.5),
]


@pytest.mark.parametrize(
    ("row", "units"), [*((row, "photographic") for row in SLIDERS), *((row, "light field") for row in IN_PIXELS)]
)
def test_a_slider_sets_its_number_and_shows_it(operated, built, row, units):
    section, actions, widget, shown, part, value = row
    before = state_of(section, *actions, units=units)
    after = operated(before, **{widget: shown})
    assert attrgetter(part)(after) == pytest.approx(value)
    operated(after)
    (item,) = [item for item in built if item.name == widget]
    assert item.value == pytest.approx(shown)
    assert item.ends[0] <= shown <= item.ends[1]


def test_the_distance_of_the_focus_is_relative_to_what_stays_still(operated):
    scene = scene_of(NINE, plan=plan_of(NINE, scale=0.5, zero=10.0), focal_px=50.0)
    after = operated(state_of("focus", units="light field", scene=scene), **{"##Distance": 0.8})
    assert after.optics.focus_disparity == pytest.approx((10.0 / 0.8 - 10.0) * 0.5)


ON = [
    ("more", (), "Portrait", "has_chosen_aperture", True),
    ("more", (), "Circle", "motion.kind", "circle"),
    ("more", (do(viewpoint.set_loop, "circle"),), "Circle", "motion.kind", None),
    ("view", (do(viewpoint.set_loop, "circle"),), "Pause##motion", "motion.is_paused", True),
    ("view", (do(lens.set_dolly, 1.0),), "Recenter", "motion.kind", "home"),
    ("view", (), "Follow the head", "tracking.address", "udp:127.0.0.1:4242"),
    ("focus", (do(lens.set_focus_tilt, (1.0, 0.0)),), "Tilt", "optics.focus_tilt", (0.0, 0.0)),
    ("aperture", (), "##ring", "optics.aperture_shape.kind", "ring"),
    ("gloss", (), "Glossy surface", "optics.gloss", FIRST_GLOSS),
    ("gloss", (GLOSSY,), "Only brush strokes", "optics.gloss.surface.strokes_only", True),
    ("gloss", (GLOSSY,), "Only one colour", "optics.gloss.surface.color", (0.5, 0.5, 0.5)),
    ("gloss", (GLOSSY,), "Erase", "gloss_brush.erases", True),
    ("gloss", (GLOSSY, STROKE), "Wipe", "optics.gloss.surface.strokes", ()),
    ("depth", (), "Invert", "depth.edits.is_inverted", True),
    ("depth", (do(depth.set_tone, DepthEdits(gamma=2.0), True),), "Reset", "depth.edits.gamma", 1.0),
    ("depth", (), "Show as colours", "inspection.overlay", "disparity"),
    ("depth", (), "Smooth", "brush.tool", "smooth"),
    ("depth", (BRUSH,), "Nearer", "brush.is_on", False),
    ("depth", (LEVEL,), "Clear the picked depth", "brush.sample", None),
    ("depth", (), "Estimate depth of new photos", "preferences.guesses_depth", True),
    ("stereo display", (), "Swap the eyes", "preferences.swaps_eyes", True),
    ("stereo display", (do(lens.set_focus, 1.5),), "Screen at the focus", "stereo.screen", 1.5),
    ("stereo display", (), "Show###show stereo", "stereo.is_shown", True),
    ("inspect", (), "Light-field units", "preferences.units", "light field"),
    ("inspect", (), "EPIs", "inspection.shows_epis", True),
    ("inspect", (), "Views", "inspection.shows_views", True),
    ("inspect", (), "Values", "inspection.shows_values", True),
    ("inspect", (), "Inpainting", "inspection.overlay", "inpainted"),
    ("inspect", (do(inspection.set_overlay, "disparity"),), "Depth", "inspection.overlay", None),
    ("inspect", (), "Photo", "inspection.comparison", "photo"),
    ("inspect", (), "Take a snapshot", "inspection.snapshot", state_of("more").optics),
]  # fmt: skip


@pytest.mark.parametrize("row", ON, ids=lambda row: row[2])
def test_a_button_or_box_does_what_it_says(operated, row):
    section, actions, widget, part, value = row
    after = operated(state_of(section, *actions), **{widget: True})
    assert attrgetter(part)(after) == value


@pytest.mark.parametrize(
    ("kind", "widget", "given", "option", "value"),
    [
        ("gif", "##seconds", 2.0, "frames", 30),
        ("gif", "##rate", 10.0, "frames", 20),
        ("gif", "##width", 48, "size", ScreenSize(48, 32)),
        ("focal-stack", "##frames", 7, "frames", 7),
        ("web", "##budget", 2.5, "budget", 2_500_000),
        ("hci", "##views", 5, "grid", GridShape(5, 5)),
    ],
)
def test_an_option_of_an_export_is_set_in_its_unit(operated, kind, widget, given, option, value):
    asked = do(
        messages.show_prompt,
        ExportPrompt(kind, "a", ExportOptions(frames=30, rate=15.0) if kind == "gif" else ExportOptions()),
    )
    assert getattr(operated(state_of("more", asked), **{widget: given}).prompt.options, option) == value


def test_a_picture_that_is_saved_keeps_its_shape(operated):
    asked = do(messages.show_prompt, SavePrompt("a.jpg", ScreenSize(60, 40)))
    assert operated(state_of("more", asked), **{"##width": 90}).prompt.size_px == (90, 60)
    assert operated(state_of("more", asked), **{"##Quality": 50.0}).prompt.form.quality == 50
    assert operated(state_of("more", asked), **{"keep GPS data": True}).prompt.form.keeps_position
