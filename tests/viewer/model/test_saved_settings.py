"""Settings in a saved picture: round trips, and texts that are damaged, foreign or hostile."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.beyond.optics import APERTURE_KINDS, ApertureMask, ApertureShape, Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.edits import BRUSH_TOOLS, DepthEdits, Stroke
from iibr_core.formats.images.metadata import SETTINGS_KEY
from iibr_core.formats.images.write import write_image
from iibr_core.gloss.settings import Gloss, GlossLight, GlossSurface
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError, ViewOffset
from tests.viewer.model.test_opening import scene_of, state_with
from viewer.app.picture_files import read_settings
from viewer.model import opening
from viewer.model.saved_settings import (
    MAX_CHARACTERS,
    left_out_note,
    settings_from_text,
    settings_text,
    source_like,
)
from viewer.model.saving import SavedSettings

numbers = st.floats(-1e3, 1e3)
masks = st.builds(lambda n: ApertureMask("ünïcode “mask”.png", 2, n, bytes([255] * 2 * n)), st.integers(1, 64))
shapes = st.builds(
    ApertureShape, st.sampled_from(APERTURE_KINDS), st.integers(3, 11), numbers, numbers, numbers, st.none() | masks
)
glosses = st.none() | st.just(Gloss(GlossSurface(0.2, 0.9, (0.5, 0.25, 1.0)), 0.1, light=GlossLight((0, 1, -2))))
pairs = st.tuples(numbers, numbers)
eyes = st.builds(ViewOffset, numbers, numbers)
optics = st.builds(Optics, eyes, numbers, numbers, numbers, pairs, numbers, shapes, numbers, numbers, glosses)
sources = st.builds(
    Source,
    st.just(""),
    st.builds(DepthChoice, st.just("auto"), st.none(), st.none() | numbers, *[st.booleans()] * 3, refine=st.booleans()),
    st.none() | st.builds(GridShape, st.integers(1, 99), st.integers(1, 99)),
    st.none() | numbers,
)
pixels = st.integers(1, 9999)
settings = st.builds(SavedSettings, optics, numbers, sources, st.tuples(pixels, pixels), view_width=st.none() | pixels)
ONE = SavedSettings(Optics(eye=ViewOffset(1, 2)), 1.5, Source("", grid=GridShape(3, 5)), (60, 40))


@given(settings)
def test_text_and_back_is_exact(saved):
    assert settings_from_text(settings_text(saved), "a.png") == saved


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_a_picture_carries_its_settings(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    mask = ApertureMask("stär.png", 64, 64, bytes(range(256)) * 16)
    saved = SavedSettings(Optics(aperture_shape=ApertureShape("mask", mask=mask)), 1.0, Source(""), (8, 6))
    write_image(path, np.zeros((6, 8, 3), np.uint8), {SETTINGS_KEY: settings_text(saved)})
    assert read_settings(path) == saved


def test_no_path_of_the_users_goes_into_a_picture():
    depth = DepthChoice(file="/home/somebody/a.pfm", model="/home/somebody/model")
    text = settings_text(SavedSettings(Optics(), 1.0, Source("/home/somebody/a.png", depth), (1, 1)))
    assert "somebody" not in text


def changed(**changes):
    """The text of ONE with some values replaced: keys are dotted paths with underscores doubled to dots."""
    whole = json.loads(settings_text(ONE))
    for name, value in changes.items():
        *path, last = name.split("__")
        target = whole
        for key in path:
            target = target[key]
        target[last] = value
    return json.dumps(whole)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", ""),
        ("no json", ""),
        ("{}", "format"),
        (settings_text(ONE)[:-20], ""),
        ("[" * 100_000, ""),
        (" " * (MAX_CHARACTERS + 1), ""),
        (changed(format=2), "format 2"),
        (changed(depth_strength=float("nan")), ""),
        (changed(depth_strength=10**400), "depth_strength"),
        (changed(optics__eye=["1", 2]), "optics.eye"),
        (changed(optics__dolly=None), "optics.dolly"),
        (changed(optics__aperture_shape__kind="star"), "optics.aperture_shape.kind"),
        (changed(optics__gloss={"roughness": 3.0}), "roughness"),
        (changed(optics__aperture_shape__blades=2), "optics.aperture_shape.blades"),
        (changed(optics__aperture_shape__mask={"name": "a", "rows": 2, "columns": 2, "values": "AAAA"}), "shape.mask"),
        (changed(optics__aperture_shape__mask={"name": "a", "rows": 10**9, "columns": 1, "values": ""}), "shape.mask"),
        (changed(source__grid=[0, 3]), "source.grid"),
        (changed(depth_edits={"gamma": 0.0}), "gamma"),
        (changed(size_px=[0, 10]), "size_px"),
    ],
    ids=range(19),
)
def test_damaged_settings_are_one_line_that_names_the_field(text, named):
    with pytest.raises(InputError, match=r"^a\.png: ") as error:
        settings_from_text(text, "a.png")
    assert named in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300
    state = opening.show_scene(state_with(None), 1, scene_of(settings=text or "x"))
    assert state.optics == Optics()
    assert [notice.is_error for notice in state.notices] == [True]


FIRST_TEXT = (
    '{"format":1,"optics":{"eye":[-0.5,0.5],"dolly":0.0,"focus_disparity":0.2,"focus_range":0.25,"focus_tilt":[0.0,'
    '1.5],"aperture_diameter":2.0,"aperture_shape":{"kind":"mask","blades":6,"rotation_deg":0.0,"ring_inner":0.5,'
    '"cat_eye":0.5,"mask":{"name":"st\\u00e4r.png","rows":1,"columns":3,"values":"AP8Q"}},"highlight_recovery":0.5,'
    '"exposure_stops":-1.0},"depth_strength":1.5,"source":{"disparity_scale":2.0,"grid":[3,5],"focus_disparity":null,'
    '"max_pixels":400000,"memory_bytes":1073741824,"quality":"balanced"},"size_px":[741,500]}'
)
"""As the first version wrote it: `refine` and depth edits came later; quality and the machine's two limits went."""

LATER_TEXT = FIRST_TEXT.replace('"balanced"}', '"balanced","refine":0.5}')[:-1].replace(
    '"max_pixels":400000,"memory_bytes":1073741824,', ""
) + (
    ',"depth_edits":{"is_inverted":true,"far_clip":0.125,"near_clip":1.0,"gamma":2.0,"strokes":[{"tool":"nearer",'
    '"points":[[0.5,0.25],[0.75,0.25]],"radius":0.03,"strength":0.25}]}}'
)
SAVED = SavedSettings(
    Optics(
        eye=ViewOffset(t=-0.5, s=0.5),
        focus_disparity=0.2,
        focus_range=0.25,
        focus_tilt=(0.0, 1.5),
        aperture_diameter=2.0,
        aperture_shape=ApertureShape("mask", mask=ApertureMask("stär.png", 1, 3, b"\x00\xff\x10")),
        highlight_recovery=0.5,
        exposure_stops=-1.0,
    ),
    1.5,
    Source("", DepthChoice(file_scale=2.0), GridShape(3, 5)),
    (741, 500),
)
STROKE = Stroke("nearer", ((0.5, 0.25), (0.75, 0.25)), 0.03, 0.25)


def test_texts_written_before_are_read():
    assert settings_from_text(FIRST_TEXT, "a.png") == SAVED
    edits = DepthEdits(is_inverted=True, far_clip=0.125, gamma=2.0, strokes=(STROKE,))
    later = replace(SAVED, depth_edits=edits)
    assert settings_from_text(LATER_TEXT, "a.png") == later


@pytest.mark.parametrize(("text", "is_on"), [("0", False), ("0.35", True)])
def test_a_strength_of_refinement_is_read_as_a_switch(text, is_on):
    saved = settings_from_text(LATER_TEXT.replace('"refine":0.5', f'"refine":{text}'), "a.png")
    assert saved.source.depth.refine is is_on


def test_numbers_of_numpy_are_written_like_any():
    plain, numpy = (replace(SAVED, optics=Optics(focus_disparity=kind(0.1))) for kind in (float, np.float64))
    assert settings_text(numpy) == settings_text(plain)


def test_what_a_later_program_added_is_named_and_the_rest_counts():
    strokes = [{"tool": "nearer", "points": [[0.5, 0.25]], "radius": 0.03, "strength": 0.25, "tilt_deg": 5}]
    text = changed(film="grain", optics__bokeh={"deep": [1]}, depth_edits={"strokes": strokes}, source__a="\n" * 90)
    state = opening.show_scene(state_with(None), 1, scene_of(settings=text))
    (notice,) = state.notices
    assert not notice.is_error
    assert notice.offer.unknown_fields == ("optics.bokeh", "source.a", "film", "depth_edits.strokes.tilt_deg")
    assert replace(notice.offer, unknown_fields=(), depth_edits=ONE.depth_edits) == ONE
    assert "optics.bokeh, source.a, film and 1 more" in notice.text
    assert "film" not in settings_text(notice.offer)


@pytest.mark.parametrize(
    ("name", "reason"), [("plain.png", "no settings"), ("text.png", "not a picture"), ("gone.png", "no such file")]
)
def test_pictures_without_settings_and_other_files(tmp_path, name, reason):
    write_image(tmp_path / "plain.png", np.zeros((4, 4, 3), np.uint8))
    (tmp_path / "text.png").write_text("this is no picture")
    with pytest.raises(InputError, match=reason) as error:
        read_settings(tmp_path / name)
    assert name in str(error.value)


def test_strokes_are_limited_only_in_files_from_elsewhere():
    strokes = tuple(Stroke(BRUSH_TOOLS[k % 3], ((0.5, 0.5),), 0.03, 0.25) for k in range(2000))
    saved, longer = (replace(SAVED, depth_edits=DepthEdits(strokes=strokes * count)) for count in (1, 6))
    assert settings_from_text(settings_text(saved), "a.png") == saved
    with pytest.raises(InputError, match=r"12,000 strokes"):
        settings_from_text(settings_text(longer), "a.png")
    assert settings_from_text(settings_text(longer), "a.png", is_own=True) == longer


def test_limits_of_the_machine_in_old_texts_are_left_out_without_a_word():
    saved = settings_from_text(changed(source__max_pixels=2**70, source__memory_bytes="all"), "a.png")
    assert saved == ONE
    assert left_out_note(saved) == ""
    assert source_like(Source("photo.png", max_pixels=10_000), saved, ()).max_pixels == 10_000


def test_what_gloss_no_longer_has_is_named_only_where_it_was_used():
    used = settings_from_text(changed(optics__gloss={"environment": "/etc/passwd", "photo_shines": True}), "a.png")
    assert used.optics.gloss == Gloss()
    assert "optics.gloss.environment, optics.gloss.photo_shines" in left_out_note(used)
    unused = settings_from_text(changed(optics__gloss={"environment": "", "photo_shines": False}), "a.png")
    assert left_out_note(unused) == ""


def test_options_given_beat_the_saved_ones():
    source = Source("photo.png", DepthChoice("model", "map.pfm", 2.0), GridShape(9, 9))
    merged = source_like(source, ONE, given={"grid"})
    assert merged == Source("photo.png", DepthChoice("model", "map.pfm"), GridShape(9, 9))
    assert source_like(source, ONE, ()).grid == GridShape(3, 5)
