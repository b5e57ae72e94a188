"""Opening for exports: the whole photo, even if the window shows a sketch first."""

from pathlib import Path

import pytest

from iibr_core.exports.kinds import ExportOptions, export_kind
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource, open_for_export
from iibr_core.scenes.lens_limits import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, InputError
from tests.iibr_core.scenes.test_opening import write_large_photo


@pytest.mark.parametrize("kind", ["hci", "disparity"])
def test_a_large_photo_is_exported_whole(tmp_path: Path, kind: str) -> None:
    source = Source(str(write_large_photo(tmp_path)), grid=GridShape(3, 3))
    opened = open_for_export(export_kind(kind), ExportOptions(), source, 1.0, LensChoice(), lambda scene: None, None)
    assert opened.loaded is not None
    assert (opened.scene.size, opened.scene.is_sketch) == ((1600, 1200), False)
    assert opened.centre.colors.shape == (1200, 1600, 3)


@pytest.mark.parametrize("size_px", [(0, 5), (5, -1), (20_000, 20_000)])
def test_absurd_sizes_are_refused(source: ExportSource, size_px: tuple[int, int]) -> None:
    with pytest.raises(InputError, match=rf"{size_px[0]}x{size_px[1]} px: .* million"):
        source.draw(RenderSettings(source.optics, ScreenSize(*size_px)))
