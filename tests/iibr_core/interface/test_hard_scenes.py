"""The public interface on scenes that are hard in every way: compared with `tests/golden/interface`."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import iibr_core as iibr
from iibr_core.color import encoded_from_stored
from tests.iibr_core import hard_scenes as hard
from tests.iibr_core.facts import colors, require_golden, spread

LENSES: dict[str, dict[str, Any]] = {
    "near": {"focus": 1.2, "aperture": 2.0},
    "far": {"focus": -0.72, "aperture": 2.0, "focus_range": 0.3},
    "place": {"at": (70.0, 30.0), "f_number": 1.0, "blades": 5, "rotation": 20.0, "roundness": 0.3},
    "corner": {"at": (95.0, 0.0)},
    "tilted": {"focus": 0.2, "aperture": 2.0, "tilt": (0.9, -0.4)},
    "ring": {"focus": 0.2, "aperture": 3.0, "ring": 0.8},
    "cat's eye": {"focus": 1.2, "aperture": 3.0, "cat_eye": 0.9, "highlights": 2.0},
    "mask": {"focus": 1.2, "aperture": 3.0, "mask": "mask.png", "rotation": 90.0},
    "closed": {"aperture": 0.0, "highlights": 1.0},
}
FIELD_LENSES: dict[str, dict[str, Any]] = {
    "near": {"focus": 2.0, "aperture": 3.0},
    "far": {"focus": -2.0, "aperture": 2.2, "tilt": (0.5, 1.0), "blades": 3},
    "place": {"at": (4.0, 30.0), "aperture": 4.0, "highlights": 1.0},
    "wide": {"focus": 0.0, "aperture": 4.1},
}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    Image.fromarray(np.uint8([[255, 0], [0, 60]])).save(tmp_path / "mask.png")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shown(picture: np.ndarray) -> list[str]:
    return colors(np.rint(255 * np.clip(picture, 0, 1)))


def through(field: iibr.LightField, lenses: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return pictures through each lens with what is said of it, or the refusal."""
    pictures: dict[str, Any] = {}
    for name, options in lenses.items():
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                picture = field.refocus(**options, cameras=24)
                pictures[name] = [spread(picture), *shown(picture), *(str(each.message) for each in said)]
            except iibr.InputError as error:
                pictures[name] = str(error)
    return pictures


def facts_of(field: iibr.LightField) -> dict[str, Any]:
    ends = [(0, 0), (0, -1), (-1, -1)]
    inpainted = None if field.inpainted is None else field.inpainted.sum(axis=(2, 3)).tolist()
    return {
        "grid": field.grid, "type": field.views.dtype.name, "focal_px": field.focal_px, "name": field.name,
        "row_step": field.row_step, "inpainted": inpainted,
        "disparity": None if field.disparity is None else [spread(field.disparity[at]) for at in ends],
        "views": [shown(encoded_from_stored(field.views[at])) for at in ends],
    }  # fmt: skip


def test_a_photo_is_seen_from_anywhere_through_every_lens(folder, regenerate_golden) -> None:
    source = hard.write_hard_photo(folder)
    scene = iibr.open(source.path, refine=False, max_pixels=source.max_pixels)
    assert np.abs(scene.photo - hard.photo_view()).max() < 2 / 255
    field = scene.light_field((2, 4), depth_strength=3.0)
    plan = scene.plan((2, 4), depth_strength=-0.5)
    facts = {
        "scene": [scene.name, scene.focal_px, scene.depth_source, *scene.notes, spread(scene.disparity)],
        "plan": [plan.grid, plan.disparity_scale, plan.disparity_zero, plan.disparity_range_px, plan.reasons[:3]],
        **facts_of(field), "between": shown(field.view(-1.5, -0.25)), **through(field, LENSES),
    }  # fmt: skip
    require_golden(facts, "interface", "photo", 2, regenerate_golden)


def test_a_bright_photo_keeps_its_light(folder, regenerate_golden) -> None:
    disparity = hard.flat_map(hard.NEAR_PX, hard.FAR_PX)
    pixels = np.clip(hard.field_view(1, 2), 0, None)
    field = iibr.from_arrays(pixels, disparity, 60.0, "bright").light_field((3, 4), parallax="literal")
    np.testing.assert_allclose(field.views[1, 2], pixels, atol=1e-3)
    lenses = {"near": FIELD_LENSES["near"], "lost": {"focus": 0.0, "aperture": 2.0, "highlights": 1.0}}
    require_golden({**facts_of(field), **through(field, lenses)}, "interface", "bright", 2, regenerate_golden)
    field.save("bright_eslf.png", "eslf")
    read = iibr.open("bright_eslf.png").light_field()
    assert np.abs(read.views[0, 3] / 255.0 - np.clip(field.views[0, 3], 0, 1)).max() < 1 / 255


def test_a_field_of_uneven_rows_is_refocused_saved_and_opened_again(folder, regenerate_golden) -> None:
    scene = iibr.open(hard.write_hard_field(folder / "field").path)
    assert np.abs(scene.photo - hard.field_view(1, 2)).max() < 2e-3
    field = scene.light_field()
    for v, u in np.ndindex(*hard.GRID):
        np.testing.assert_allclose(field.views[v, u], hard.field_view(v, u), atol=2e-3)
    np.testing.assert_allclose(field.view(-2, 1), hard.field_view(2, 0), atol=2e-3)
    facts = {"scene": [scene.name, scene.depth_source, *scene.notes], **facts_of(field)}
    require_golden({**facts, **through(field, FIELD_LENSES)}, "interface", "field", 2, regenerate_golden)
    square = np.s_[11:17, 31:37]
    assert np.abs(field.refocus(hard.NEAR_PX, 3.0)[square] - field.view(0, 0)[square]).max() < 0.02, "stays sharp"
    field.save("saved")
    again = iibr.open("saved").light_field()
    np.testing.assert_allclose(again.views, field.views, atol=2e-3)
    assert (again.focal_px, again.disparity, again.name) == (pytest.approx(60), None, "saved")
