"""Streams of grey pictures in VP9, in WebM files, for the views of a web page.

Every browser decodes VP9, but browsers differ in how they bring it to RGB and halve its colours. A page therefore has
streams of luma only, of profile 0 and limited range: 16 to 235 for the levels 0 to 255. The luma of the colours (as
JPEG has it: Rec. 601, full range) is one stream, Cb above Cr another, so edges of colours stay as sharp as in 4:4:4.
Each stream begins with its only key frame and has no hidden frames: each chunk is one picture.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import ImageSize

CODEC, RATE = "libvpx-vp9", 25
OPTIONS = {"b": "0", "auto-alt-ref": "0", "lag-in-frames": "0", "g": "9999", "row-mt": "1"}
"""Options of the encoder: quality is constant, and no frame is hidden."""
USUAL_SPEED, SMALL_SPEED = 4, 2
"""Speeds of the encoder (`cpu-used`): the second takes twice the time, for a tenth less with colours and a quarter less
with disparity."""
MPEG_RANGE, LOWEST_LUMA, LUMA_STEPS = 1, 16, 219
YCC_FROM_RGB = np.array(
    [[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]], dtype=np.float32
)
"""Matrix of JPEG; 128 is added to Cb and Cr."""

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Stream:
    """A WebM file, and the (offset, size) of each frame in it."""

    data: bytes
    chunks: tuple[tuple[int, int], ...]


def can_encode() -> bool:
    """Return whether PyAV is installed, with an encoder of VP9."""
    try:
        from av import codecs_available
    except ImportError:
        return False
    return CODEC in codecs_available


def luma_of(colors: Bytes) -> Bytes:
    """Return the luma (H, W) of colours (H, W, 3)."""
    return _rounded(colors @ YCC_FROM_RGB[0])


def chroma_of(colors: Bytes) -> Bytes:
    """Return Cb above Cr (2 H, W)."""
    return _rounded(np.concatenate([colors @ row for row in YCC_FROM_RGB[1:]]) + 128)


def encode_levels(pictures: Iterable[Bytes], size: ImageSize, crf: int, speed: int = USUAL_SPEED) -> Stream:
    """Return pictures (H, W) of this size as a stream. crf: 0 to 63, the best first."""
    import av

    packed, frames = BytesIO(), list[bytes]()
    with av.open(packed, "w", format="webm", options={"fflags": "bitexact"}) as container:
        options = OPTIONS | {"crf": str(crf), "cpu-used": str(speed)}
        stream: Any = container.add_stream(CODEC, rate=RATE, options=options)
        stream.height, stream.width = (side + side % 2 for side in size)
        stream.pix_fmt, stream.codec_context.color_range = "yuv420p", MPEG_RANGE
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(_even_frame(picture), format="yuv420p")
            frame.color_range = MPEG_RANGE
            for packet in stream.encode(frame):
                frames.append(bytes(packet))
                container.mux(packet)
        container.mux(stream.encode(None))
    return _with_places(packed.getvalue(), frames)


def _with_places(data: bytes, frames: list[bytes]) -> Stream:
    chunks, end = list[tuple[int, int]](), 0
    for frame in frames:
        begin = data.index(frame, end)
        end = begin + len(frame)
        chunks.append((begin, len(frame)))
    return Stream(data, tuple(chunks))


def _even_frame(levels: Bytes) -> Bytes:
    """Return a frame in 4:2:0 of even width and height without colours: luma above Cb above Cr."""
    padded = np.pad(levels, [(0, side % 2) for side in levels.shape], mode="edge")
    luma = LOWEST_LUMA + padded * np.float32(LUMA_STEPS / 255)
    return np.concatenate([_rounded(luma), np.full((len(padded) // 2, padded.shape[1]), 128, np.uint8)])


def _rounded(values: NDArray[np.float32]) -> Bytes:
    rounded: Bytes = np.rint(np.clip(values, 0, 255)).astype(np.uint8)
    return rounded
