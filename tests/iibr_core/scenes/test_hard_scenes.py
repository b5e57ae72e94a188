"""Scenes that are hard in every way, opened with choices that go together: compared with `tests/golden/scenes`."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from iibr_core.beyond.optics import CENTRE, Optics
from iibr_core.color import encoded_from_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, Stroke
from iibr_core.gloss.settings import Gloss, GlossSurface
from iibr_core.scenes.f_numbers import aperture_of, disparity_as_given, equivalent_f_number, f_number
from iibr_core.scenes.inputs import inputs_of
from iibr_core.scenes.large_photo import complete_fills, hidden_of_photo, load_large, read_large
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.lens_limits import aperture_limit, first_aperture, focus_limits, focus_span
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.photo import lens_views_of
from iibr_core.scenes.scene import DepthSettings, Scene, SceneReady, SceneRequest, Source, ViewReady
from iibr_core.scenes.scene_gloss import add_gloss
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core.facts import colors, require_golden, spread
from tests.iibr_core.hard_scenes import write_hard_field, write_hard_photo

STROKE = DepthEdits(strokes=(Stroke("nearer", ((0.2, 0.7),), 0.15, 1.0),))
INVERTED = DepthEdits(is_inverted=True, near_clip=0.9)
PHOTOS: dict[str, tuple[dict[str, Any], float, DepthEdits]] = {
    "photo": ({"focus_disparity": 0.24}, 3.0, UNEDITED),
    "behind": ({"grid": GridShape(4, 3)}, -2.0, STROKE),
    "inverted": ({"max_pixels": None, "grid": GridShape(1, 4)}, 2.0, INVERTED),
    "literal": ({"is_literal": True, "grid": GridShape(2, 2)}, 1.0, UNEDITED),
    "planned": ({"grid": None}, 4.0, UNEDITED),
}
LENSES = {
    "closed": LensChoice(), "focus": LensChoice(focus=9.0), "place": LensChoice(focus_at=(39.0, 11.0), f_number=2.0),
    "eye": LensChoice(eye=ViewOffset(-5.0, 0.5), aperture=99.0, tilt=(50.0, -50.0), focus_range=9.0),
}  # fmt: skip


def shown(stored: np.ndarray) -> list[str]:
    return colors(np.rint(255 * np.clip(encoded_from_stored(stored), 0, 1)))


def opened(source: Source, **request: Any) -> tuple[SceneReady, list[ViewReady]]:
    ready, *views = results_of(SceneRequest(1, source, takes_drafts=False, **request), lambda: CENTRE)
    assert isinstance(ready, SceneReady)
    return ready, views


def scene_facts(scene: Scene) -> dict[str, Any]:
    """Return what a scene states, and what follows for lenses."""
    stated = {name: getattr(scene, name) for name in STATED}
    levels = scene.levels and [scene.levels.low, scene.levels.high, sum(scene.levels.counts[:32])]
    limits = [*focus_limits(scene), focus_span(scene), aperture_limit(scene), first_aperture(scene)]
    stops = [f_number(scene, 2.0), equivalent_f_number(scene, 2.0), aperture_of(scene, 5.6)]
    words = [*scene.notes, *scene.problems, scene.depth_origin and scene.depth_origin.line]
    given = disparity_as_given(scene, 0.5)
    return {**stated, "levels": levels, "limits": limits, "stops": stops, "words": words, "given": given}


STATED = (
    "name", "size", "own_size", "grid", "view_count", "disparity_range_px", "depth_source", "is_hdr", "focal_px",
    "has_view_disparity", "subject_disparity_px", "inverse_metres", "infinity_px", "found_span_px", "row_step",
)  # fmt: skip


def view_facts(views: list[ViewReady]) -> dict[str, Any]:
    """Return the order of the views, some of them, and the surface that is hidden behind the middle one."""
    (hidden,) = (each.hidden for each in views if each.hidden is not None)
    some = [each.view for each in (views[0], views[1], views[-1])]
    return {
        "order": [[each.view.row, each.view.column, each.view.is_final] for each in views],
        "views": [[spread(view.disparity), *shown(view.colors)] for view in some],
        "inpainted": [int(each.view.inpainted.sum()) for each in views if each.view.inpainted is not None],
        "hidden": [int(hidden.mask.sum()), spread(hidden.disparity[hidden.mask]), *shown(hidden.colors)],
    }  # fmt: skip


def lens_facts(scene: Scene, disparity: np.ndarray) -> dict[str, Any]:
    chosen = {name: choice.optics_on(scene, disparity) for name, choice in LENSES.items()}
    return {
        name: [*optics.eye, optics.focus_disparity, optics.focus_range, *optics.focus_tilt, optics.aperture_diameter]
        for name, optics in chosen.items()
    }


@pytest.mark.parametrize("name", PHOTOS)
def test_photos_are_opened_as_before(tmp_path, name, regenerate_golden) -> None:
    changes, strength, edits = PHOTOS[name]
    source = replace(write_hard_photo(tmp_path), **changes)
    settings = None if edits == UNEDITED else DepthSettings(False, edits)
    ready, views = opened(source, depth_strength=strength, depth_settings=settings)
    scene, loaded, plan = ready.scene, ready.loaded, ready.scene.plan
    large = load_large(source, loaded, plan, 10**6)
    fills = complete_fills(source, loaded, plan)
    hidden = hidden_of_photo(loaded, plan, scene, fills)
    optics = Optics(focus_disparity=scene.disparity_range_px[1], aperture_diameter=2.0, highlight_recovery=0.5)
    seen = lens_views_of(source, loaded, plan, optics, 1.0)(ViewOffset(0.5, -1.0))
    facts = {
        **scene_facts(scene), **view_facts(views), **lens_facts(scene, ready.centre.disparity),
        "large": [*large.size, spread(large.disparity), *shown(large.pixels)],
        "in its colours": shown(read_large(source, loaded, 1500).pixels),
        "behind": [int(hidden.mask.sum()), spread(hidden.disparity), *shown(hidden.colors)],
        "through the lens": [spread(seen.disparity), *shown(seen.colors)],
        "inputs": [path.name for path in inputs_of(source)],
    }  # fmt: skip
    require_golden(facts, "scenes", name, 2, regenerate_golden)


def test_a_field_is_opened_as_before_with_gloss_and_without(tmp_path, regenerate_golden) -> None:
    source = write_hard_field(tmp_path / "field")
    ready, views = opened(source)
    gloss = Gloss(reflectance=1.0, roughness=0.4, surface=GlossSurface(farthest=0.5))
    glossy = list(add_gloss((each.view for each in views), gloss, ready.scene))
    places = {(view.row, view.column): view for view in glossy}
    facts = {
        **scene_facts(ready.scene), **view_facts(views), **lens_facts(ready.scene, ready.centre.disparity),
        "glossy": {str(at): shown(places[at].colors) for at in ((1, 2), (0, 0), (2, 3))},
        "inputs": [path.name for path in inputs_of(source)],
    }  # fmt: skip
    require_golden(facts, "scenes", "field", 2, regenerate_golden)
    bare = replace(source, depth=DepthChoice())
    drafts = [each.scene for each in results_of(SceneRequest(1, bare), lambda: CENTRE) if isinstance(each, SceneReady)]
    assert not drafts[0].has_view_disparity
    assert {scene.infinity_px for scene in drafts} == {ready.scene.infinity_px}
