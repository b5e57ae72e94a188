"""Stacks, read by Pillow and OpenImageIO: every picture is what the renderer shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from PIL import Image

from iibr_core.color import srgb_from_linear
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.exports.stack import aperture_sweep, focal_stack
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.rendering.optics import Optics
from iibr_core.runtime.tiling import Cancelled
from iibr_core.scenes.screen_size import ScreenSize
from tests.iibr_core.exports.conftest import exported

SIZE = ScreenSize(96, 64)
KINDS = {"focal-stack": focal_stack, "aperture-sweep": aperture_sweep}


@pytest.mark.parametrize("kind", KINDS)
def test_folder(source: ExportSource, tmp_path: Path, kind: str) -> None:
    folder = exported(source, kind, tmp_path / "stack", {"focus_disparity": 0.2}, frames=3)
    stack = KINDS[kind](source.scene, Optics(focus_disparity=0.2), 3)
    names = {path.name for path in folder.iterdir()}
    assert names == {"all_in_focus.png", "disparity.pfm", *(f"{name}.png" for name, _ in stack)}
    for name, optics in (*stack, ("all_in_focus", Optics(focus_disparity=0.2))):
        assert np.array_equal(np.asarray(Image.open(folder / f"{name}.png")), source.draw(RenderSettings(optics, SIZE)))
    disparity = read_pfm(folder / "disparity.pfm")
    low, high = source.scene.disparity_range_px
    assert (disparity.min(), disparity.max()) == (pytest.approx(low), pytest.approx(high))


@pytest.mark.parametrize("kind", KINDS)
def test_tiffs_have_16_bits(source: ExportSource, tmp_path: Path, kind: str) -> None:
    folder = exported(source, f"{kind}-tiff", tmp_path / "stack", frames=2)
    stack = [*KINDS[kind](source.scene, Optics(), 2), ("all_in_focus", Optics())]
    assert {path.name for path in folder.iterdir()} == {"disparity.pfm", *(f"{name}.tif" for name, _ in stack)}
    for name, optics in stack:
        pixels = tifffile.imread(folder / f"{name}.tif")
        expected = srgb_from_linear(source.draw(RenderSettings(optics, SIZE, is_linear=True))) * 65535
        assert pixels.dtype == np.uint16
        np.testing.assert_allclose(pixels, expected, atol=1)


@pytest.mark.parametrize("kind", KINDS)
def test_parts_of_an_exr_are_linear_light(source: ExportSource, tmp_path: Path, kind: str) -> None:
    path = exported(source, f"{kind}-exr", tmp_path / "stack.exr", frames=2)
    stack = [*KINDS[kind](source.scene, Optics(), 2), ("all_in_focus", Optics())]
    for index, (name, optics) in enumerate(stack):
        part = oiio.ImageBuf(str(path), index, 0)
        assert part.spec().get_string_attribute("oiio:subimagename") == name
        expected = source.draw(RenderSettings(optics, SIZE, is_linear=True))
        np.testing.assert_allclose(part.get_pixels(oiio.FLOAT)[..., :3], expected, rtol=1e-3, atol=1e-5)
        assert ("disparity" in part.spec().channelnames) == (name == "all_in_focus")


def test_a_focal_stack_goes_from_far_to_near_with_an_open_aperture(source: ExportSource) -> None:
    stack = focal_stack(source.scene, Optics(), 5)
    focuses = [optics.focus_disparity for _, optics in stack]
    assert (focuses[0], focuses[-1]) == source.scene.disparity_range_px
    assert focuses == sorted(focuses)
    assert all(optics.aperture_diameter > 0 for _, optics in stack)
    assert [optics.aperture_diameter for _, optics in focal_stack(source.scene, Optics(aperture_diameter=1.5), 1)] == [
        1.5
    ]


@pytest.mark.parametrize(("kind", "name"), [("focal-stack", "stack"), ("focal-stack-exr", "a.exr"), ("gif", "a.gif"),
                                            ("quilt", "a.png"), ("hci", "field"), ("exr", "a.exr")])  # fmt: skip
def test_what_is_stopped_leaves_nothing(source: ExportSource, tmp_path: Path, kind: str, name: str) -> None:
    steps = iter(range(1000))
    stopped = replace(source, should_stop=lambda: next(steps) > 2)
    with pytest.raises(Cancelled):
        exported(stopped, kind, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
