from collections.abc import Iterator
from typing import Any

import pytest

from iibr_core.exports.kinds import EXPORTS, ExportOptions, export_path
from iibr_core.exports.source import ExportSource, open_for_export, write_export
from iibr_core.scenes import opening, photo
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ViewUpdate
from tests.viewer.conftest import write_scene
from viewer.display.offscreen import OffscreenScene

OF_A_ROW, OF_A_LENS = 4, 20


@pytest.mark.parametrize(
    ("name", "chosen", "aperture", "max_views"),
    [
        ("anaglyph", ExportOptions(), 1.5, 14),
        ("gif", ExportOptions(motion="swing", frames=5), 0.0, OF_A_ROW),
        ("gif", ExportOptions(motion="aperture", frames=5), 2.5, OF_A_LENS),
        ("epi", ExportOptions(), 0.0, OF_A_ROW),
        ("point-cloud", ExportOptions(), 0.0, 4),
    ],
)
def test_an_export_makes_only_the_views_that_it_shows(tmp_path, monkeypatch, name, chosen, aperture, max_views) -> None:
    kind, lens = EXPORTS[name], LensChoice(aperture=aperture)
    source, made = Source(str(write_scene(tmp_path)), grid=GridShape(5, 5)), []
    views_of_photo = photo.views_of_photo

    def counted(*arguments: Any, **named: Any) -> Iterator[ViewUpdate]:
        for view in views_of_photo(*arguments, **named):
            made.extend([view] if (view.row, view.column) != (2, 2) else [])
            yield view

    def written(opened: ExportSource, stem: str) -> bytes:
        target = export_path(kind, tmp_path / f"{stem}{kind.endings[0]}", opened.scene, chosen)
        write_export(kind, target, opened, chosen)
        return target.read_bytes()

    for module in (opening, photo):
        monkeypatch.setattr(module, "views_of_photo", counted)
    with OffscreenScene() as drawer:
        opened = open_for_export(kind, chosen, source, 1.0, lens, lambda scene: None, drawer.open_for_export)
        few = written(opened, "few")
        assert 0 < len(made) <= max_views
        every = drawer.open_for_export(source, 1.0, lens, lambda scene: None)
        assert len(made) >= 24
        assert written(every, "all") == few
