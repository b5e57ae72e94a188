"""Going from photo to photo in the state: order, ends, what is read ahead, what the filmstrip shows."""

from dataclasses import replace

import pytest

from iibr_core.exports.photo_folder import FolderPhoto, in_order
from iibr_core.scenes.scene import Source
from tests.viewer.model.test_opening import scene_of
from viewer.model import folder, inspection, opening
from viewer.model.app_state import AppState
from viewer.model.folder import AHEAD, filmstrip_range, photos_ahead

NAMES = ("IMG_10.jpg", "img_9.jpg", "IMG_11.jpg", "Ä.png")


def state_at(name, names=NAMES):
    photos = tuple(FolderPhoto(name, float(-i)) for i, name in enumerate(names))
    return folder.set_photos(AppState(source=Source(f"/photos/{name}", max_pixels=7)), "/photos", photos)


def open_name(state):
    return state.source.path.removeprefix("/photos/")


def test_numbers_in_names_are_counted_and_times_go_first_where_that_is_wanted():
    state = state_at("img_9.jpg")
    assert [photo.name for photo in state.folder.photos] == ["img_9.jpg", "IMG_10.jpg", "IMG_11.jpg", "Ä.png"]
    state = folder.set_order(state, "time")
    assert [photo.name for photo in state.folder.photos] == list(reversed(NAMES))
    assert in_order((), "name") == ()


def test_steps_open_the_next_photo_with_what_was_decided_and_end_at_the_ends():
    state = folder.step(state_at("img_9.jpg"), 1)
    assert (open_name(state), state.generation) == ("IMG_10.jpg", 1)
    assert [source.path[8:] for source in photos_ahead(state, AHEAD)] == ["IMG_11.jpg", "img_9.jpg", "Ä.png"]
    back = folder.step(state, -1)
    assert [source.path[8:] for source in photos_ahead(folder.step(folder.step(back, 3), -1), (1,))] == ["IMG_10.jpg"]
    assert state.source.max_pixels == 7
    state = folder.step(folder.step(state, 1), 1)
    assert open_name(state) == "Ä.png"
    assert folder.step(state, 1) is folder.step(state, 0) is state
    assert open_name(folder.step(state, -9)) == "img_9.jpg"


def test_steps_do_nothing_where_no_photo_of_the_folder_is_open():
    other = opening.open_source(state_at("img_9.jpg"), Source("/other/a.jpg"))
    other = opening.show_scene(other, other.generation, scene_of(source=other.source))
    assert other.folder is None, "the filmstrip of another folder goes"
    elsewhere = replace(state_at("img_9.jpg"), source=Source("/other/img_9.jpg"))
    for state in (AppState(), elsewhere, state_at("gone.jpg")):
        assert folder.step(state, 1) is state


def test_a_walk_through_a_folder_leaves_one_recent_file():
    state = replace(state_at("img_9.jpg"), recent=("/other/a.jpg", "/other/b.jpg"))
    state = opening.show_scene(state, 0, scene_of(source=Source("/photos/img_9.jpg")))
    state = inspection.set_overlay(state, "disparity")
    for _ in range(2):
        state = folder.step(state, 1)
        state = opening.show_scene(state, state.generation, scene_of(source=state.source))
    assert state.inspection.overlay == "disparity", "one may look through a folder's depth"
    opened = ("/photos/img_9.jpg", "/other/a.jpg", "/other/b.jpg")
    assert state.recent == ("/photos/IMG_11.jpg", *opened), "what was opened by name stays"
    state = opening.open_source(state, Source("/photos/img_9.jpg"))
    state = opening.show_scene(state, state.generation, scene_of(source=Source("/photos/img_9.jpg")))
    assert state.recent[:2] == ("/photos/img_9.jpg", "/photos/IMG_11.jpg")
    assert state.inspection.overlay is None


def test_a_photo_that_does_not_open_is_told_once_and_passed_by():
    state = state_at("img_9.jpg")
    state = opening.show_scene(state, 0, scene_of(source=Source("/photos/img_9.jpg", max_pixels=7)))
    damaged = folder.step(replace(state, source=state.scene.source), 1)
    state = opening.report_failure(damaged, damaged.generation, "IMG_10.jpg: damaged")
    assert open_name(state) == "img_9.jpg"
    assert "damaged" in state.notices[-1].text
    state = folder.step(state, 1)
    assert open_name(state) == "IMG_11.jpg"
    state = opening.show_scene(state, state.generation, scene_of(source=state.source))
    assert open_name(folder.step(state, -1)) == "img_9.jpg"
    assert opening.stop(damaged).folder.unreadable == frozenset()


@pytest.mark.parametrize(
    ("place", "scrolled", "most", "shown"),
    [
        (0, 0, 3, range(0, 3)),
        (5, 0, 3, range(4, 7)),
        (9, 0, 3, range(7, 10)),
        (5, 2, 4, range(5, 9)),
        (0, 0, 0, range(0)),
        (3, -99, 3, range(0, 3)),
        (3, 99, 99, range(0, 10)),
    ],
)
def test_the_filmstrip_shows_what_lies_around_the_open_photo(place, scrolled, most, shown):
    names = tuple(f"{i}.jpg" for i in range(10))
    state = folder.scroll(state_at(f"{place}.jpg", names), scrolled)
    assert filmstrip_range(state, most) == shown
