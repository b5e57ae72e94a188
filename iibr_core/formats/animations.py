"""Moving pictures: MP4 and WebM by PyAV, GIF and WebP by Pillow. They repeat for ever where the player can do so."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.formats.files import reason_of
from iibr_core.formats.outputs import write_file
from iibr_core.remedies import FixableError, Remedy
from iibr_core.types import ImageSize, InputError

VIDEOS: dict[str, tuple[str, dict[str, str]]] = {
    ".mp4": ("libx264", {"crf": "18", "preset": "medium"}),
    ".webm": ("libvpx-vp9", {"crf": "28", "b": "0", "cpu-used": "4", "row-mt": "1"}),
}
"""Codec and its options, by the ending of the file."""
BT709, MPEG_RANGE = 1, 1
MAX_VIDEO_PIXELS, MAX_VIDEO_SIDE_PX = 3840 * 2160, 4096
"""Largest default size of a video: phones decode H.264 of level 5.1, which has such pictures 30 times a second."""
PALETTE_COLORS, PALETTE_SAMPLES, PALETTE_SIDE_PX = 255, 8, 128
"""Colours of a GIF, and the number and size of the evenly spread frames that they are chosen from."""
WEBP_QUALITY = 85


def even_size(size: ImageSize) -> ImageSize:
    """Return the largest size within `size` that 4:2:0 can have: two rows and columns share their colours."""
    return ImageSize(*(max(side - side % 2, 2) for side in size))


def require_even(path: Path, size: ImageSize) -> None:
    """Raise InputError if a file in 4:2:0 cannot have this size."""
    if size != even_size(size):
        raise InputError(f"{path}: width and height must be even, not {size}; give {even_size(size)}")


def video_width(aspect: float) -> int:
    """Return the largest default width of a video of this aspect (width / height), in pixels."""
    return int(min(math.sqrt(MAX_VIDEO_PIXELS * aspect), MAX_VIDEO_SIDE_PX * min(aspect, 1.0)))


def write_animation(path: Path, frames: Iterable[NDArray[np.uint8]], size: ImageSize, rate: float) -> None:
    """Write an animation of the kind that the ending states: one of VIDEOS, .gif or .webp; whole or not at all.

    frames: (H, W, 3), sRGB-encoded, all of this size. rate: frames a second.
    """
    is_video = path.suffix.lower() in VIDEOS
    if is_video:
        require_even(path, size)
    with write_file(path) as temporary:
        if is_video:
            _write_video(path, temporary, frames, size, rate)
        else:
            _write_pictures(path, temporary, frames, rate)


def _write_video(
    path: Path, temporary: Path, frames: Iterable[NDArray[np.uint8]], size: ImageSize, rate: float
) -> None:
    """Write 4:2:0, 8 bits, BT.709, which every player takes. An MP4 has its index first, so it plays while it loads."""
    import av
    from av.codec.codec import UnknownCodecError

    codec, options = VIDEOS[path.suffix.lower()]
    exact = Fraction(rate).limit_denominator(1001)
    layout = {"movflags": "+faststart", "movie_timescale": str(exact.numerator)} if codec == "libx264" else {}
    try:
        with av.open(str(temporary), "w", format=path.suffix[1:].lower(), options=layout) as container:
            stream: Any = container.add_stream(codec, rate=exact, options=options)
            stream.width, stream.height, stream.pix_fmt = size.width, size.height, "yuv420p"
            context = stream.codec_context
            context.colorspace = context.color_primaries = context.color_trc = BT709
            context.color_range = MPEG_RANGE
            for pixels in frames:
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
                yuv = frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
                yuv.pts = None
                container.mux(stream.encode(yuv))
            container.mux(stream.encode(None))
    except UnknownCodecError as error:
        raise InputError(f"{path}: PyAV here has no encoder {codec}; write .gif or .webp") from error
    except av.error.FFmpegError as error:
        raise FixableError(f"{path}: cannot be written ({reason_of(error)})", Remedy.PLACE) from error


def _write_pictures(path: Path, temporary: Path, frames: Iterable[NDArray[np.uint8]], rate: float) -> None:
    """Write an animated GIF or WebP."""
    pictures = [np.ascontiguousarray(pixels) for pixels in frames]
    options: dict[str, Any]
    if path.suffix.lower() == ".gif":
        images, step_ms, options = _quantized(pictures), 10, {"format": "GIF", "disposal": 1, "optimize": False}
    else:
        images = [Image.fromarray(pixels) for pixels in pictures]
        step_ms, options = 1, {"format": "WEBP", "quality": WEBP_QUALITY, "method": 4}
    durations = _durations_ms(len(images), rate, step_ms)
    images[0].save(temporary, save_all=True, append_images=images[1:], duration=durations, loop=0, **options)


def _quantized(frames: Sequence[NDArray[np.uint8]]) -> list[Any]:
    """Return GIF frames with one dithered palette; flat parts would flicker with several."""
    chosen = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, PALETTE_SAMPLES).astype(int))]
    step = max(max(chosen[0].shape[:2]) // PALETTE_SIDE_PX, 1)
    sheet = np.concatenate([pixels[::step, ::step] for pixels in chosen], axis=1)
    palette = Image.fromarray(np.ascontiguousarray(sheet)).quantize(PALETTE_COLORS, method=Image.Quantize.MEDIANCUT)
    dither = Image.Dither.FLOYDSTEINBERG
    return [Image.fromarray(pixels).quantize(palette=palette, dither=dither) for pixels in frames]


def _durations_ms(count: int, rate: float, step_ms: int) -> list[int]:
    """Return the duration of each frame in whole steps that add up to the whole duration."""
    ends = np.rint(np.arange(count + 1) * 1000 / rate / step_ms).astype(int) * step_ms
    return [max(int(duration), step_ms) for duration in np.diff(ends)]
