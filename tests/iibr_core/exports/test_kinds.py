"""The table of kinds: defaults of the options, and places where exports may be written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name

import pytest

from iibr_core.exports.kinds import (
    EXPORTS,
    ExportOptions,
    export_kind,
    require_ending,
    require_export_place,
    shear_margin,
    with_defaults,
)
from iibr_core.exports.source import ExportSource
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, InputError
from tests.iibr_core.exports.conftest import exported

FOLDERS = [name for name, kind in EXPORTS.items() if not kind.endings]
SCENE = Scene(Source("a.png"), "a", 741, 500, GridShape(5, 4), (-1.0, 2.0), "file")
SHARP_NEAR = Optics(focus_disparity=10.0)


@pytest.mark.parametrize(
    ("kind", "size", "frames", "rate"),
    [
        ("mp4", (740, 500), 120, 30),
        ("gif", (480, 324), 60, 15),
        ("webp", (741, 500), 100, 25),
        ("focal-stack", (741, 500), 16, 0),
    ],
)
def test_defaults(kind: str, size: tuple[int, int], frames: int, rate: float) -> None:
    options = with_defaults(EXPORTS[kind], ExportOptions(), SCENE, SHARP_NEAR)
    assert (options.size, options.frames, options.rate, options.eyes, options.row) == (size, frames, rate, 3, 250)


def test_choices_replace_defaults() -> None:
    chosen = ExportOptions(ScreenSize(10, 20), "go", 0.0, "swing", None, 7, 3.5, 0)
    assert with_defaults(EXPORTS["mp4"], chosen, SCENE, SHARP_NEAR) == chosen
    assert with_defaults(EXPORTS["mp4"], replace(chosen, frames=0), SCENE, SHARP_NEAR).frames == 14, "four seconds"


def test_pictures_for_eyes_are_as_wide_as_what_both_show() -> None:
    """The middle of 4 views lies half a step beside view 2: the left eye is 2 steps from it, sheared by 20 px."""
    assert shear_margin(SCENE, SHARP_NEAR, 3.0) == pytest.approx(20 / 741)
    assert with_defaults(EXPORTS["sbs"], ExportOptions(), SCENE, SHARP_NEAR).size == (741 - 40, 500)
    too_near = Optics(focus_disparity=1e6)  # is refused when it is drawn
    assert with_defaults(EXPORTS["sbs"], ExportOptions(), SCENE, too_near).size == (1, 500)


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_of_other_files_is_never_replaced(source: ExportSource, tmp_path: Path, name: str) -> None:
    kind, folder = EXPORTS[name], tmp_path / "out"
    require_export_place(kind, folder, (), False)
    exported(source, name, folder, **({"frames": 1} if "frames" in kind.supports else {}))
    with pytest.raises(AlreadyThereError):
        require_export_place(kind, folder, (), False)
    require_export_place(kind, folder, (), True)
    mine = next(place for place in (folder / "images", folder) if place.is_dir()) / "mine.png"
    mine.touch()
    with pytest.raises(InputError, match=r"mine\.png"):
        require_export_place(kind, folder, (), True)


@pytest.mark.parametrize("name", EXPORTS)
def test_every_kind_has_its_functions_and_its_words(name: str) -> None:
    kind = export_kind(name)
    for entry in filter(None, (kind.write, kind.optics, kind.path, kind.gallery)):
        assert callable(resolve_name(f"iibr_core.exports.{entry}"))
    assert all(ending == ending.lower() for ending in kind.endings)
    if kind.endings:
        with pytest.raises(InputError, match="must end in"):
            require_ending(kind, Path("a.txt"))
    assert len({other.words for other in EXPORTS.values()}) == len(EXPORTS)


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(InputError, match="hologram"):
        export_kind("hologram")
