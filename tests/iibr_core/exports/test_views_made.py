"""Exports make only the views that they show, and write the same file as with all views."""

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from iibr_core.exports.kinds import EXPORTS, ExportOptions, export_path
from iibr_core.exports.source import ExportSource, OpenDrawn, open_for_export, write_export
from iibr_core.scenes import opening, photo
from iibr_core.scenes.lens_limits import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError, ViewUpdate
from tests.viewer.conftest import write_scene
from viewer.display.offscreen import OffscreenScene

OF_A_ROW, OF_A_LENS = 4, 20
FEW = {"frames": 5}
WRITTEN_AT = re.compile(rb"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d")
CASES: list[tuple[str, dict[str, Any], float, int]] = [
    ("sbs", {}, 0.0, 2),
    ("anaglyph", {}, 1.5, 14),
    ("quilt", {}, 0.0, OF_A_ROW),
    ("gif", {"motion": "swing", **FEW}, 0.0, OF_A_ROW),
    ("gif", {"motion": "aperture", **FEW}, 2.5, OF_A_LENS),
    ("epi", {}, 0.0, OF_A_ROW),
    ("point-cloud", {}, 0.0, 4),
    ("hci", {}, 0.0, 24),
]


@pytest.fixture
def new_views(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[ViewUpdate]]:
    """The views other than the photo that were made."""
    views: list[ViewUpdate] = []
    views_of_photo = photo.views_of_photo

    def counted(*arguments: Any, **named: Any) -> Iterator[ViewUpdate]:
        for view in views_of_photo(*arguments, **named):
            views.extend([view] if (view.row, view.column) != (2, 2) else [])
            yield view

    for module in (opening, photo):
        monkeypatch.setattr(module, "views_of_photo", counted)
    return views


def written(path: Path) -> dict[str, str]:
    """Hashes of the files, without the second in which OpenEXR files are written."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return {
        str(file.relative_to(path)): hashlib.sha256(WRITTEN_AT.sub(b"", file.read_bytes())).hexdigest()
        for file in files
        if file.is_file()
    }


@pytest.mark.parametrize(("kind", "options", "aperture", "max_views"), CASES)
def test_an_export_makes_only_the_views_that_it_shows(
    tmp_path: Path,
    new_views: list[ViewUpdate],
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    options: dict[str, Any],
    aperture: float,
    max_views: int,
) -> None:
    if EXPORTS[kind].needs:
        pytest.importorskip("av")
    source, chosen = Source(str(write_scene(tmp_path)), grid=GridShape(5, 5)), ExportOptions(**options)
    lens = LensChoice(aperture=aperture)

    def export(name: str, open_drawn: OpenDrawn) -> dict[str, str]:
        new_views.clear()
        try:
            opened = open_for_export(
                EXPORTS[kind], chosen, source, 1.0, lens, lambda scene: None, drawer.open_for_export
            )
        except InputError as error:
            pytest.skip(str(error))
        target = export_path(EXPORTS[kind], tmp_path / f"{name}{(*EXPORTS[kind].endings, '')[0]}", opened.scene, chosen)
        write_export(EXPORTS[kind], target, opened, chosen)
        return written(target)

    with OffscreenScene() as drawer:
        few = export("few", drawer.open_for_export)
        assert len(new_views) <= max_views
        make_all(monkeypatch)
        every = export("all", drawer.open_for_export)
        assert len(new_views) == 24
    assert few == every


def make_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make all views from now on."""
    monkeypatch.setattr("viewer.display.offscreen.views_seen_by", lambda pictures, grid: None)
    views = ExportSource.views
    monkeypatch.setattr(ExportSource, "views", lambda self, *given, wanted=None, **named: views(self, *given, **named))
