"""What is offered to be exported, by purpose, and under which names it is written."""

from dataclasses import replace
from pathlib import Path

import pytest

from iibr_core.exports.kinds import EXPORTS, PURPOSES, ExportOptions
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from tests.viewer.model.test_opening import scene_of, state_with
from viewer.model import saving
from viewer.model.saving import (
    MAX_FILES,
    ExportPrompt,
    SavePrompt,
    as_other_kind,
    first_kind,
    kinds_for,
    usual_export_path,
    written_path,
)

STATE = state_with(replace(scene_of(source=Source("/photos/bike.jpg")), name="bike"))
PLAIN = ExportOptions()


def test_every_kind_has_its_purpose_and_every_purpose_a_kind_that_can_be_made_anywhere():
    offered = [name for purpose in PURPOSES for name in kinds_for(purpose)]
    assert sorted(offered) == sorted(EXPORTS)
    assert not any(EXPORTS[first_kind(purpose)].needs for purpose in PURPOSES)
    assert (first_kind("display"), first_kind("software")) == ("quilt", "focal-stack")


def test_names_say_what_is_in_them():
    assert usual_export_path(STATE, "gif") == "/photos/bike-iibr.gif"
    assert usual_export_path(STATE, "anaglyph") == "/photos/bike-anaglyph.png"
    assert usual_export_path(STATE, "hci") == "/photos/bike-hci"
    assert usual_export_path(STATE, "eslf") == "/photos/bike_eslf.png"


def test_another_kind_keeps_the_name_that_was_typed():
    usual = ExportPrompt("gif", usual_export_path(STATE, "gif"))
    assert as_other_kind(STATE, usual, "mp4") == ExportPrompt("mp4", "/photos/bike-iibr.mp4")
    typed = ExportPrompt("gif", "/tmp/for_ann.gif", replace(PLAIN, frames=3))
    assert as_other_kind(STATE, typed, "mp4").path == "/tmp/for_ann.mp4"
    assert as_other_kind(STATE, typed, "hci").path == "/tmp/for_ann"
    assert as_other_kind(STATE, ExportPrompt("hci", "/tmp/for_ann"), "sbs").path == "/tmp/for_ann.png"
    assert as_other_kind(STATE, ExportPrompt("gif", "  "), "mp4").path == "/photos/bike-iibr.mp4"


@pytest.mark.parametrize(
    ("kind", "typed", "written"),
    [
        ("gif", "a.gif", "a.gif"),
        ("gif", "a", "a.gif"),
        ("anaglyph", "e_sbs.png", "e_sbs.png"),
        ("sbs", "e_sbs.png", "e_sbs.png"),
        ("sbs", "e_2x1.jpg", "e_2x1.jpg"),
        ("half-sbs", "e_half_sbs.png", "e_half_sbs.png"),
        ("over-under", "e_ou.png", "e_ou.png"),
        ("half-over-under", "e-hou.png", "e-hou.png"),
        ("sbs", "e.png", "e_LRF_Full_SBS.png"),
        ("half-sbs", "e_sbs.png", "e_sbs_LRF_Half_SBS.png"),
        ("depth", "a_depth.pfm", "a_depth.pfm"),
        ("depth", "a.pfm", "a_depth.pfm"),
        ("hci", "field", "field"),
        ("eslf", "a", "a_eslf.png"),
        ("eslf", "a_eslf", "a_eslf.png"),
    ],
)
def test_a_name_is_written_as_typed_but_where_it_must_say_what_is_in_it(kind, typed, written):
    assert STATE.scene is not None
    assert written_path(EXPORTS[kind], f" {typed} ", STATE.scene, PLAIN) == Path(written)
    with pytest.raises(InputError, match="no name yet"):
        written_path(EXPORTS[kind], "  ", STATE.scene, PLAIN)


def test_files_that_were_written_or_failed_are_listed_the_latest_first():
    state = STATE
    for number in range(MAX_FILES + 2):
        state = saving.finish_job(state, Path(f"/a/{number}.gif"), "", ExportPrompt("gif", "a"))
    state = saving.fail_job(state, Path("/a/last.png"), "the disk is full", SavePrompt("a", ScreenSize(6, 4)))
    assert [Path(file.path).stem for file in state.files[:3]] == ["last", "13", "12"]
    assert len(state.files) == MAX_FILES
    assert state.files[0].problem == state.notices[-1].text == "the disk is full"
    assert state.notices[-2].text == "Exported /a/13.gif"
