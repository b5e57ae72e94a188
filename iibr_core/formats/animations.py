"""Moving pictures: MP4 and WebM by PyAV, GIF, WebP and APNG by Pillow. They run for ever where the player can do so."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import reason_of
from iibr_core.formats.outputs import write_file
from iibr_core.types import ImageSize, InputError

VIDEOS: dict[str, tuple[str, dict[str, str]]] = {
    ".mp4": ("libx264", {"crf": "18", "preset": "medium"}),
    ".webm": ("libvpx-vp9", {"crf": "28", "b": "0", "cpu-used": "4", "row-mt": "1"}),
}
"""Codec and what it is told, by the ending."""
SUFFIXES = (*VIDEOS, ".gif", ".webp", ".png")
BT709, MPEG_RANGE = 1, 1
PALETTE_COLORS = 255
PALETTE_SAMPLES = 8
"""Frames that the palette of a GIF is taken from, evenly spread."""
PALETTE_SIDE_PX = 128
WEBP_QUALITY = 85


def even_size(size: ImageSize) -> ImageSize:
    """The largest size within it that videos can have: two rows and columns share their colours."""
    return ImageSize(*(max(side - side % 2, 2) for side in size))


def require_video_size(path: Path, size: ImageSize) -> None:
    """Raise InputError where a video cannot be of that size."""
    if path.suffix.lower() in VIDEOS and size != even_size(size):
        raise InputError(f"{path}: a video's width and height are even, not {size}; give {even_size(size)}")


def write_animation(path: Path, frames: Iterable[NDArray[np.uint8]], size: ImageSize, rate: float) -> None:
    """Write frames (H, W, 3), sRGB-encoded, all of this size, `rate` of them a second; whole or not at all.

    The path's ending says what is written, see SUFFIXES. Raises InputError for others, odd sizes of videos, no frames,
    and where it cannot be written; what the frames raise goes through.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        raise InputError(f"{path}: an animation can be written as {', '.join(SUFFIXES)}")
    require_video_size(path, size)
    with write_file(path) as temporary:
        if kind in VIDEOS:
            count = _write_video(path, temporary, frames, size, rate)
        elif kind == ".gif":
            count = _write_gif(temporary, list(frames), rate)
        else:
            count = _write_frames(temporary, frames, rate)
        if not count:
            raise InputError(f"{path}: has no frames; an animation needs at least one")


def _write_video(path: Path, temporary: Path, frames: Iterable[NDArray[np.uint8]], size: ImageSize, rate: float) -> int:
    """4:2:0 of 8 bits, BT.709, as every player takes it; returns how many frames there were."""
    import av
    from av.codec.codec import UnknownCodecError

    codec, told = VIDEOS[path.suffix.lower()]
    count = 0
    try:
        # By a file, not its name: that need not be text.
        with temporary.open("wb") as file, av.open(file, "w", format=path.suffix[1:].lower()) as container:
            stream: Any = container.add_stream(codec, rate=Fraction(rate).limit_denominator(1001), options=told)
            stream.width, stream.height, stream.pix_fmt = size.width, size.height, "yuv420p"
            context = stream.codec_context
            context.colorspace = context.color_primaries = context.color_trc = BT709
            context.color_range = MPEG_RANGE
            for pixels in frames:
                count += 1
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
                container.mux(stream.encode(_as_yuv(frame)))
            container.mux(stream.encode(None))
    except UnknownCodecError as error:
        raise InputError(f"{path}: PyAV here has no encoder {codec}; write .gif or .webp") from error
    except av.error.FFmpegError as error:
        # Of what failed in writing to the file PyAV says only that something did.
        reason = error.__context__ if isinstance(error.__context__, OSError) else error
        raise InputError(f"{path}: cannot be written ({reason_of(reason)}); choose another place") from error
    return count


def _as_yuv(frame: Any) -> Any:
    converted = frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
    converted.pts = None
    return converted


def _write_gif(temporary: Path, frames: Sequence[NDArray[np.uint8]], rate: float) -> int:
    """One palette for all frames, or flat parts would flicker; what it lacks is dithered."""
    from PIL import Image

    if not frames:
        return 0
    palette = _palette(frames)
    dither = Image.Dither.FLOYDSTEINBERG
    images = [Image.fromarray(pixels).quantize(palette=palette, dither=dither) for pixels in frames]
    images[0].save(
        temporary,
        "GIF",
        save_all=True,
        append_images=images[1:],
        duration=_durations_ms(len(images), rate, step_ms=10),
        loop=0,
        disposal=1,
        optimize=False,
    )
    return len(images)


def _palette(frames: Sequence[NDArray[np.uint8]]) -> Any:
    from PIL import Image

    chosen = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, PALETTE_SAMPLES).astype(int))]
    step = max(max(chosen[0].shape[:2]) // PALETTE_SIDE_PX, 1)
    sheet = np.concatenate([pixels[::step, ::step] for pixels in chosen], axis=1)
    return Image.fromarray(np.ascontiguousarray(sheet)).quantize(PALETTE_COLORS, method=Image.Quantize.MEDIANCUT)


def _write_frames(temporary: Path, frames: Iterable[NDArray[np.uint8]], rate: float) -> int:
    """Animated WebP or PNG, frame after frame."""
    from PIL import Image

    images = [Image.fromarray(np.ascontiguousarray(pixels)) for pixels in frames]
    if not images:
        return 0
    durations = _durations_ms(len(images), rate, step_ms=1)
    told: dict[str, Any] = {"quality": WEBP_QUALITY, "method": 4} if temporary.suffix.lower() == ".webp" else {}
    images[0].save(temporary, save_all=True, append_images=images[1:], duration=durations, loop=0, **told)
    return len(images)


def _durations_ms(count: int, rate: float, step_ms: int) -> list[int]:
    """How long each frame is shown, in whole steps, so that all together last as long as they should."""
    ends = np.rint(np.arange(count + 1) * 1000 / rate / step_ms).astype(int) * step_ms
    return [max(int(duration), step_ms) for duration in np.diff(ends)]
