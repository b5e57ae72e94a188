"""Animations, read by PyAV and Pillow: every frame is what the renderer shows, and the last leads to the first."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

from iibr_core.beyond.optics import Optics
from iibr_core.exports.animation import optics_on_path
from iibr_core.exports.kinds import ANIMATIONS, EXPORTS, ExportOptions, with_defaults
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError, ViewOffset
from tests.iibr_core.exports.conftest import exported

SIZE = ScreenSize(96, 64)
COUNT = 6


def path_of(source: ExportSource, **options: Any) -> list[Optics]:
    settings = with_defaults(EXPORTS["gif"], ExportOptions(**options), source.scene, source.optics)
    return optics_on_path(source.scene, source.optics, settings)


def expected_frames(source: ExportSource) -> list[np.ndarray]:
    return [source.draw(RenderSettings(optics, SIZE)).astype(int) for optics in path_of(source, frames=COUNT)]


def video_frames(path: Path) -> tuple[list[np.ndarray], float, str]:
    import av

    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        frames = [
            frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray().astype(int)
            for frame in container.decode(stream)
        ]
        return frames, float(stream.average_rate or 0), stream.codec_context.pix_fmt or ""


@pytest.mark.parametrize("kind", ["mp4", "webm"])
def test_videos_show_what_the_renderer_shows(source: ExportSource, tmp_path: Path, kind: str) -> None:
    pytest.importorskip("av")
    frames, rate, pixels = video_frames(exported(source, kind, tmp_path / f"a.{kind}", frames=COUNT, rate=12.5))
    assert (len(frames), rate, pixels) == (COUNT, pytest.approx(12.5), "yuv420p")
    for frame, expected in zip(frames, expected_frames(source)):
        # Colours are shared by 2x2 pixels: means over them are compared, which neither hue nor range may move.
        means = [picture.reshape(16, 4, 24, 4, 3).mean(axis=(1, 3)) for picture in (frame, expected)]
        assert np.abs(means[0] - means[1]).mean() < 4


@pytest.mark.parametrize(("kind", "tolerance"), [("gif", 12), ("webp", 10)])
def test_animated_images_show_what_the_renderer_shows(
    source: ExportSource, tmp_path: Path, kind: str, tolerance: float
) -> None:
    out = exported(source, kind, tmp_path / f"a.{kind}", frames=COUNT, rate=8.0)
    with Image.open(out) as image:
        assert image.info["loop"] == 0
        frames = [(np.asarray(frame.convert("RGB")).astype(int), frame.info["duration"]) for frame in _frames(image)]
    assert len(frames) == COUNT
    assert sum(duration for _, duration in frames) == pytest.approx(1000 * COUNT / 8.0, abs=10)
    for (frame, _), expected in zip(frames, expected_frames(source)):
        assert np.abs(frame - expected).mean() <= tolerance


def _frames(image: Image.Image) -> Iterator[Image.Image]:
    for frame in ImageSequence.Iterator(image):
        frame.load()  # reads its duration
        yield frame


@pytest.mark.parametrize("motion", ANIMATIONS)
def test_paths_are_closed_and_move(source: ExportSource, motion: str) -> None:
    path = path_of(source, motion=motion, frames=24)
    around = np.array([(*optics.eye, optics.focus_disparity, optics.aperture_diameter) for optics in path])
    steps = np.linalg.norm(np.diff(around, axis=0, append=around[:1]), axis=1)
    assert steps.max() > 0.01
    assert steps[-1] <= steps.max(), "no leap from the last to the first"
    assert all(0 <= optics.aperture_diameter <= aperture_limit(source.scene.grid) for optics in path)


def test_a_rack_rests_on_both_surfaces_and_glides_between_them(source: ExportSource) -> None:
    far, near = source.scene.disparity_range_px
    for rack, (start, end) in ((None, (near, far)), ((0.4, -0.1), (0.4, -0.1))):
        path = path_of(source, motion="rack", rack=rack, frames=20)
        shares = [(optics.focus_disparity - start) / (end - start) for optics in path]
        assert shares == pytest.approx([*shares[:11], *shares[9:0:-1]], abs=1e-6), "there and back"
        assert [shares[k] for k in (0, 2, 5, 8, 10)] == pytest.approx([0, 0, 0.5, 1, 1], abs=1e-6)
        assert shares[3] == pytest.approx((1 / 6) ** 2 * (3 - 2 / 6), abs=1e-6)
        assert min(optics.aperture_diameter for optics in path) > 0


def test_a_path_goes_through_its_keys(source: ExportSource, tmp_path: Path) -> None:
    keys = tmp_path / "keys.txt"
    keys.write_text("\ufeff# s t focus aperture\n-1 0 0.5 1\n1, 0.5, -0.1, 2\n\n0 -1\n", "utf-8")
    path = path_of(replace(source, optics=replace(source.optics, aperture_diameter=1.5)), keys=keys, frames=6)
    assert path[0].eye == ViewOffset(0, -1)
    assert (path[2].eye, path[2].focus_disparity, path[2].aperture_diameter) == (ViewOffset(0.5, 1), -0.1, 2)
    assert (path[4].eye, path[4].focus_disparity, path[4].aperture_diameter) == (ViewOffset(-1, 0), 0.0, 1.5)


@pytest.mark.parametrize("text", ["", "1", "1 2 3 4 5", "a b", "nan 0", "900 0", "0 0 500"])
def test_keys_that_mean_nothing_are_refused(source: ExportSource, tmp_path: Path, text: str) -> None:
    keys = tmp_path / "keys.txt"
    keys.write_text(text or "\n")
    with pytest.raises(InputError, match="keys"):
        path_of(source, keys=keys, frames=4)


@pytest.mark.parametrize("name", ["a.mp4", "a.webm"])
def test_videos_have_even_sizes(source: ExportSource, tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="give 96x64"):
        exported(source, name[2:], tmp_path / name, size=ScreenSize(97, 65))
    assert list(tmp_path.iterdir()) == []
