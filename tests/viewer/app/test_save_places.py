"""Where pictures and maps may be saved: not onto what is read, not over other things unasked, and told beforehand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from iibr_core.depth.choice import DepthChoice, DepthOrigin
from iibr_core.exports.render_settings import require_size
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.scenes.inputs import inputs_of
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape, InputError
from tests.viewer.conftest import write_scene
from viewer.app.save_places import inputs_of_scene, map_path, picture_path
from viewer.model.state.app_state import AppState
from viewer.model.state.tasks import SaveTask


@pytest.mark.parametrize("path_for", [picture_path, map_path])
def test_files_are_not_replaced_unasked(tmp_path: Path, path_for: Callable[[SaveTask, tuple[Path, ...]], Path]) -> None:
    path = tmp_path / "taken.png"
    path.write_bytes(b"mine")
    with pytest.raises(AlreadyThereError, match=r"taken\.png"):
        path_for(SaveTask(str(path), (8, 8)), ())
    assert path_for(SaveTask(str(path), (8, 8), may_replace=True), ()) == path


def test_a_name_without_an_ending_gets_one(tmp_path: Path) -> None:
    assert picture_path(SaveTask(f" {tmp_path}/a ", (8, 8)), ()) == tmp_path / "a.png"
    assert map_path(SaveTask(f"{tmp_path}/a", (8, 8)), ()) == tmp_path / "a.pfm"


@pytest.mark.parametrize("name", ["", "a.bmp", "missing-folder/a.png"])
def test_places_that_cannot_be_written_are_told_before_anything_is_drawn(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError):
        picture_path(SaveTask(str(tmp_path / name) if name else "", (8, 8)), ())


@pytest.mark.parametrize("path_for", [picture_path, map_path])
def test_nothing_is_saved_onto_what_is_read_not_even_where_it_may_be_replaced(
    tmp_path: Path, path_for: Callable[[SaveTask, tuple[Path, ...]], Path]
) -> None:
    photo = write_scene(tmp_path)
    (tmp_path / "link.png").symlink_to(photo)
    for name in ("scene.png", "link.png"):
        with pytest.raises(InputError, match="is read here") as caught:
            path_for(SaveTask(str(tmp_path / name), (8, 8), may_replace=True), (photo,))
        assert not isinstance(caught.value, AlreadyThereError)


def test_what_is_read_is_all_that_was_named(tmp_path: Path) -> None:
    """Models by name are no files; the folder of one is."""
    (tmp_path / "model").mkdir()
    choice = DepthChoice(file="map.pfm", model=str(tmp_path / "model"))
    assert inputs_of(Source("a.png", choice)) == (Path("a.png"), Path("map.pfm"), tmp_path / "model")
    assert inputs_of(Source("a.png", DepthChoice(model="depth-pro"))) == (Path("a.png"),)


def test_what_is_read_for_a_scene(tmp_path: Path) -> None:
    """What is open, what is being opened, and the map that was found beside the photo."""
    scene = Scene(Source("open.png"), "open", 9, 6, GridShape(1, 1), (0.0, 1.0), "map")
    scene = replace(scene, depth_origin=DepthOrigin("file", "map", file="open_disparity.npy"))
    state = AppState(source=Source("next.png"), scene=scene)
    names = ("next.png", "open.png", "open_disparity.npy")
    assert inputs_of_scene(state) == tuple(map(Path, names))
    assert inputs_of_scene(AppState()) == ()


@pytest.mark.parametrize("size_px", [(0, 5), (5, -1), (16384, 16384)])
def test_absurd_sizes_are_refused(size_px: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="1 to 100 million"):
        require_size(size_px)


def test_a_home_that_is_not_known_is_a_name_like_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        picture_path(SaveTask("~nobody-of-this-name/a.png", (8, 8)), ())
