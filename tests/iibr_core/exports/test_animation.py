from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image, ImageSequence

from iibr_core.beyond.optics import Optics
from iibr_core.color import srgb_from_linear
from iibr_core.exports.animation import optics_on_path
from iibr_core.exports.kinds import ANIMATIONS, EXPORTS, ExportOptions, with_defaults
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.exports.stack import focal_stack
from iibr_core.formats.images.iso_boxes import boxes
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.runtime.work import Cancelled, stoppable
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


def video_frames(path: Path) -> tuple[list[np.ndarray], dict[str, Any]]:
    """Return the frames of a video, and what PyAV says of it."""
    import av

    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        frames = [
            frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray().astype(int)
            for frame in container.decode(stream)
        ]
        context = stream.codec_context
        colors = {context.color_primaries, context.color_trc, context.colorspace, context.color_range}
        facts = {"rate": stream.average_rate, "pixels": context.pix_fmt, "colors": colors}
        return frames, facts | {"microseconds": container.duration, "tag": context.codec_tag, "profile": stream.profile}


@pytest.mark.parametrize("kind", ["mp4", "webm"])
def test_videos_show_what_the_renderer_shows(source, tmp_path, kind) -> None:
    pytest.importorskip("av")
    path = exported(source, kind, tmp_path / f"a.{kind}", frames=COUNT, rate=12.5)
    frames, facts = video_frames(path)
    assert (len(frames), facts["rate"], facts["pixels"]) == (COUNT, 12.5, "yuv420p")
    assert (facts["microseconds"], facts["colors"]) == (480_000, {1}), "all by BT.709, limited range"
    if kind == "mp4":
        assert (facts["tag"], facts["profile"]) == ("avc1", "High")
        kinds = [kind for kind, _ in boxes(path.read_bytes())]
        assert kinds.index(b"moov") < kinds.index(b"mdat"), "browsers begin before all is there"
    for frame, expected in zip(frames, expected_frames(source)):
        # Colours are shared by 2x2 pixels: means over them are compared, which neither hue nor range may move.
        means = [picture.reshape(16, 4, 24, 4, 3).mean(axis=(1, 3)) for picture in (frame, expected)]
        assert np.abs(means[0] - means[1]).mean() < 4


@pytest.mark.parametrize(
    ("kind", "rate", "count", "delays"),
    [("gif", 100.0, 12, {20}), ("gif", 30.0, 12, {30, 40}), ("gif", 120.0, 12, {20}), ("webp", 240.0, 24, {20})],
)
def test_no_frame_is_so_short_that_browsers_slow_it_down(source, tmp_path, kind, rate, count, delays) -> None:
    """They show a frame of less than 20 ms for 100 ms. The whole time stays."""
    with Image.open(exported(source, kind, tmp_path / f"a.{kind}", frames=count, rate=rate)) as image:
        durations = [frame.copy().info["duration"] for frame in ImageSequence.Iterator(image)]
    assert set(durations) == delays
    assert sum(durations) == pytest.approx(1000 * count / rate, abs=5)


@pytest.mark.parametrize(("kind", "tolerance"), [("gif", 12), ("webp", 10)])
def test_animated_images_show_what_the_renderer_shows(source, tmp_path, kind, tolerance) -> None:
    out = exported(source, kind, tmp_path / f"a.{kind}", frames=COUNT, rate=8.0)
    with Image.open(out) as image:
        assert image.info["loop"] == 0
        frames, duration = [], 0
        for frame in ImageSequence.Iterator(image):
            frames.append(np.asarray(frame.convert("RGB")).astype(int))
            duration += frame.info["duration"]
    assert (len(frames), duration) == (COUNT, pytest.approx(1000 * COUNT / 8.0, abs=10))
    for frame, expected in zip(frames, expected_frames(source), strict=True):
        assert np.abs(frame - expected).mean() <= tolerance


@pytest.mark.parametrize("motion", ANIMATIONS)
def test_paths_are_closed_and_move(source, motion) -> None:
    path = path_of(source, motion=motion, frames=24)
    around = np.array([(*optics.eye, optics.focus_disparity, optics.aperture_diameter) for optics in path])
    steps = np.linalg.norm(np.diff(around, axis=0, append=around[:1]), axis=1)
    assert steps.max() > 0.01
    assert steps[-1] <= steps.max(), "no leap from the last to the first"
    if motion == "focus":
        assert (around[:, 2].min(), around[0, 2]) == pytest.approx(source.scene.disparity_range_px), "from near"
        assert around[:, 2].max() == around[0, 2]
    assert all(0 <= optics.aperture_diameter <= aperture_limit(source.scene) for optics in path)


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


@pytest.mark.parametrize(("kind", "name"), [("mp4", "a.mp4"), ("webm", "a.webm"), ("spatial-photo", "a.heic")])
def test_videos_and_spatial_photos_have_even_sizes(source, tmp_path, kind, name) -> None:
    with pytest.raises(InputError, match="give 96x64"):
        exported(source, kind, tmp_path / name, size=ScreenSize(97, 65))
    assert list(tmp_path.iterdir()) == []


def test_folder(source, tmp_path) -> None:
    folder = exported(source, "focal-stack", tmp_path / "stack", {"focus_disparity": 0.2}, frames=3)
    stack = focal_stack(source.scene, Optics(focus_disparity=0.2), 3)
    *others, sharp = stack.values()
    assert sharp == Optics(focus_disparity=0.2)
    low, high = source.scene.disparity_range_px
    assert [optics.focus_disparity for optics in others] == pytest.approx([low, (low + high) / 2, high])
    assert all(optics.aperture_diameter > 0 for optics in others)
    assert focal_stack(source.scene, Optics(aperture_diameter=1.5), 1)["focus_000"].aperture_diameter == 1.5
    assert {path.name for path in folder.iterdir()} == {"disparity.pfm", *(f"{name}.png" for name in stack)}
    for name, optics in stack.items():
        assert np.array_equal(np.asarray(Image.open(folder / f"{name}.png")), source.draw(RenderSettings(optics, SIZE)))
    disparity = read_pfm(folder / "disparity.pfm")
    assert (disparity.min(), disparity.max()) == (pytest.approx(low), pytest.approx(high))


def test_a_stack_beside_the_centre_has_no_disparity_of_another_viewpoint(source, tmp_path) -> None:
    folder = exported(source, "focal-stack", tmp_path / "stack", {"eye": ViewOffset(0.5, -1.0)}, frames=1)
    assert {path.name for path in folder.iterdir()} == {"focus_000.png", "all_in_focus.png"}


def test_sixteen_bits(source, tmp_path) -> None:
    folder = exported(source, "focal-stack", tmp_path / "stack", frames=2, bits=16)
    for name, optics in focal_stack(source.scene, Optics(), 2).items():
        pixels = oiio.ImageBuf(str(folder / f"{name}.png")).get_pixels(oiio.UINT16)
        expected = srgb_from_linear(source.draw(RenderSettings(optics, SIZE, is_linear=True))) * 65535
        np.testing.assert_allclose(pixels, expected, atol=1)
    with pytest.raises(InputError, match="8 or 16"):
        exported(source, "focal-stack", tmp_path / "other", frames=2, bits=12)


@pytest.mark.parametrize(
    ("kind", "name"), [("focal-stack", "stack"), ("gif", "a.gif"), ("quilt", "a.png"), ("hci", "field")]
)
def test_what_is_stopped_leaves_nothing(source, tmp_path, kind, name) -> None:
    steps = iter(range(1000))
    with pytest.raises(Cancelled), stoppable(lambda: next(steps) > 2):
        exported(source, kind, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
