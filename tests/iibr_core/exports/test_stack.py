"""Focal stacks, read by Pillow and OpenImageIO: every picture is what the renderer shows."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from iibr_core.beyond.optics import Optics
from iibr_core.color import srgb_from_linear
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.exports.stack import focal_stack
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from tests.iibr_core.exports.conftest import exported

SIZE = ScreenSize(96, 64)


def test_folder(source: ExportSource, tmp_path: Path) -> None:
    folder = exported(source, "focal-stack", tmp_path / "stack", {"focus_disparity": 0.2}, frames=3)
    stack = focal_stack(source.scene, Optics(focus_disparity=0.2), 3)
    assert stack["all_in_focus"] == Optics(focus_disparity=0.2)
    assert {path.name for path in folder.iterdir()} == {"disparity.pfm", *(f"{name}.png" for name in stack)}
    for name, optics in stack.items():
        assert np.array_equal(np.asarray(Image.open(folder / f"{name}.png")), source.draw(RenderSettings(optics, SIZE)))
    disparity = read_pfm(folder / "disparity.pfm")
    low, high = source.scene.disparity_range_px
    assert (disparity.min(), disparity.max()) == (pytest.approx(low), pytest.approx(high))


def test_sixteen_bits(source: ExportSource, tmp_path: Path) -> None:
    folder = exported(source, "focal-stack", tmp_path / "stack", frames=2, bits=16)
    for name, optics in focal_stack(source.scene, Optics(), 2).items():
        pixels = oiio.ImageBuf(str(folder / f"{name}.png")).get_pixels(oiio.UINT16)
        expected = srgb_from_linear(source.draw(RenderSettings(optics, SIZE, is_linear=True))) * 65535
        np.testing.assert_allclose(pixels, expected, atol=1)
    with pytest.raises(InputError, match="8 or 16"):
        exported(source, "focal-stack", tmp_path / "other", frames=2, bits=12)


def test_a_focal_stack_goes_from_far_to_near_with_an_open_aperture(source: ExportSource) -> None:
    *stack, sharp = focal_stack(source.scene, Optics(), 5).values()
    focuses = [optics.focus_disparity for optics in stack]
    assert (focuses[0], focuses[-1]) == source.scene.disparity_range_px
    assert focuses == sorted(focuses)
    assert all(optics.aperture_diameter > 0 for optics in stack)
    assert sharp.aperture_diameter == 0
    assert focal_stack(source.scene, Optics(aperture_diameter=1.5), 1)["focus_000"].aperture_diameter == 1.5


@pytest.mark.parametrize(
    ("kind", "name"), [("focal-stack", "stack"), ("gif", "a.gif"), ("quilt", "a.png"), ("hci", "field")]
)
def test_what_is_stopped_leaves_nothing(source: ExportSource, tmp_path: Path, kind: str, name: str) -> None:
    steps = iter(range(1000))
    with pytest.raises(Cancelled), stoppable(lambda: next(steps) > 2):
        exported(source, kind, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
