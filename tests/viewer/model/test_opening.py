"""Scenes and states for tests; names of recent files, and what the filmstrip shows."""

from dataclasses import replace

from hypothesis import strategies as st

from iibr_core.exports.photo_folder import FolderPhoto
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape
from viewer.model import folder, opening
from viewer.model.app_state import AppState

SOURCE = Source("photo.png")
grids = st.builds(GridShape, st.integers(1, 17), st.integers(1, 17))


def plan_of(grid, scale=1.0, zero=0.0):
    return ScenePlan(grid, scale, zero, (-2.0, 3.0), 0.1, True, 0, 0, ())


def scene_of(grid=GridShape(9, 9), source=SOURCE, **changes):  # noqa: B008
    scene = Scene(source, "photo", 60, 40, grid, (-2.0, 3.0), "photo.pfm")
    return replace(scene, **changes)


def state_with(scene):
    return AppState(source=scene.source if scene else None, scene=scene, generation=1)


def test_recent_files_of_one_name_are_told_apart_by_their_folders():
    paths = ("/a/x/boxes", "C:\\photos\\tree.jpg", "/a/y/boxes/views", "/boxes", "/b/field/views", "/c/tree.jpg")
    assert opening.names_of(paths) == ["boxes (x)", "tree.jpg (photos)", "boxes (y)", "boxes", "field", "tree.jpg (c)"]
    assert opening.with_recent(tuple("abcdefgh"), "c") == tuple("cabdefgh")
    assert opening.with_recent(tuple("abcdefgh"), "i") == tuple("iabcdefg"), "eight are kept"


def test_the_filmstrip_shows_what_lies_around_the_open_photo():
    photos = tuple(FolderPhoto(f"{i}.jpg") for i in range(10))
    for place, scrolled, most, shown in (
        (0, 0, 3, range(3)), (5, 0, 3, range(4, 7)), (9, 0, 3, range(7, 10)), (5, 2, 4, range(5, 9)),
        (0, 0, 0, range(0)), (0, 0, 1, range(1)), (3, -99, 3, range(3)), (3, 99, 99, range(10)),
    ):  # fmt: skip
        state = folder.set_photos(AppState(source=Source(f"/photos/{place}.jpg")), "/photos", photos)
        assert folder.filmstrip_range(folder.scroll(state, scrolled), most) == shown
