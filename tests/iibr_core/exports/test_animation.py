from dataclasses import replace
from typing import Any

import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.exports.animation import optics_on_path
from iibr_core.exports.kinds import EXPORTS, ExportOptions, with_defaults
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.iso_boxes import boxes
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError, ViewOffset
from tests.iibr_core.exports.conftest import exported

SIZE = ScreenSize(96, 64)
COUNT = 6


def path_of(source: ExportSource, **options: Any) -> list[Optics]:
    settings = with_defaults(EXPORTS["gif"], ExportOptions(**options), source.scene, source.optics)
    return optics_on_path(source.scene, source.optics, settings)


def test_a_rack_rests_on_both_surfaces_and_glides_between_them(source) -> None:
    far, near = source.scene.disparity_range_px
    for rack, (start, end) in ((None, (near, far)), ((0.4, -0.1), (0.4, -0.1))):
        path = path_of(source, motion="rack", rack=rack, frames=20)
        shares = [(optics.focus_disparity - start) / (end - start) for optics in path]
        assert shares == pytest.approx([*shares[:11], *shares[9:0:-1]], abs=1e-6), "there and back"
        assert [shares[k] for k in (0, 2, 5, 8, 10)] == pytest.approx([0, 0, 0.5, 1, 1], abs=1e-6)
        assert shares[3] == pytest.approx((1 / 6) ** 2 * (3 - 2 / 6), abs=1e-6)
        assert min(optics.aperture_diameter for optics in path) > 0


def test_a_path_goes_through_its_keys(source, tmp_path) -> None:
    keys = tmp_path / "keys.txt"
    keys.write_text("\ufeff# s t focus aperture\n-1 0 0.5 1\n1, 0.5, -0.1, 2\n\n0 -1\n", "utf-8")
    path = path_of(replace(source, optics=replace(source.optics, aperture_diameter=1.5)), keys=keys, frames=6)
    assert path[0].eye == ViewOffset(0, -1)
    assert path[1].eye == pytest.approx((0.40625, 0.0)), "a spline of Catmull and Rom"
    assert (path[2].eye, path[2].focus_disparity, path[2].aperture_diameter) == (ViewOffset(0.5, 1), -0.1, 2)
    assert (path[4].eye, path[4].focus_disparity, path[4].aperture_diameter) == (ViewOffset(-1, 0), 0.0, 1.5)


@pytest.mark.parametrize("text", ["", "1", "1 2 3 4 5", "a b", "nan 0", "0 0\n900 0", "0 0 500"])
def test_keys_that_mean_nothing_are_refused(source, tmp_path, text) -> None:
    keys = tmp_path / "keys.txt"
    keys.write_text(text or "\n")
    with pytest.raises(InputError, match="keys"):
        path_of(source, keys=keys, frames=4)


def test_browsers_play_an_mp4_before_all_is_there(hard, tmp_path) -> None:
    av = pytest.importorskip("av")
    path = exported(hard["photo"], "mp4", tmp_path / "a.mp4", frames=2)
    kinds = [kind for kind, _ in boxes(path.read_bytes())]
    assert kinds.index(b"moov") < kinds.index(b"mdat")
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.codec_tag, stream.profile) == ("avc1", "High")
