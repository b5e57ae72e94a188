"""Readers of exported files by the descriptions of their formats: splats as SPZ, and the streams of web pages."""

import base64
import gzip
import struct
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from iibr_core.exports.web_streams import Stream

SH_BASIS_0 = 0.28209479177387814


def read_spz(path: Path) -> dict[str, np.ndarray]:
    """Places, colours and opacities (0 to 1), radii and quaternions (x, y, z), by version 2 of the format."""
    content = gzip.decompress(path.read_bytes())
    magic, version, count, degree, bits, flags, reserved = struct.unpack_from("<4sIIBBBB", content)
    assert (magic, version, degree, flags, reserved) == (b"NGSP", 2, 0, 0, 0)
    parts = np.split(np.frombuffer(content, np.uint8, offset=16), np.cumsum([9, 1, 3, 3, 3])[:-1] * count)
    places, opacities, colors, radii, rotations = (part.reshape(count, -1).astype(np.int32) for part in parts)
    low, middle, high = places.reshape(count, 3, 3).transpose(2, 0, 1)
    fixed = (low | middle << 8 | high << 16) - (high >> 7 << 24)
    return {
        "places": fixed / 2**bits,
        "opacities": opacities[:, 0] / 255,
        "colors": (colors / 255 - 0.5) / 0.15 * SH_BASIS_0 + 0.5,
        "radii": np.exp(radii / 16 - 10),
        "rotations": rotations / 127.5 - 1,
    }


def stream_in(page: str, field: dict[str, Any], name: str) -> Stream:
    """Return a stream of a page's text. field: the page's data about the field."""
    data = base64.b64decode(page.partition(f'id="{name}">')[2].partition("</script>")[0])
    return Stream(data, tuple(map(tuple, field["chunks"][name])))


def decoded_levels(stream: Stream) -> list[np.ndarray]:
    """Decode a stream by its chunks, and as a file; return its levels 0 to 255."""
    import av

    decoder, frames = av.CodecContext.create("vp9", "r"), []
    for number, (begin, size) in enumerate(stream.chunks):
        packet = av.Packet(stream.data[begin : begin + size])
        (frame,) = decoder.decode(packet) + (decoder.decode(None) if number == len(stream.chunks) - 1 else [])
        assert (frame.format.name, frame.color_range, frame.width % 2, frame.height % 2) == ("yuv420p", 1, 0, 0)
        frames.append(frame.to_ndarray()[: frame.height])
    with av.open(BytesIO(stream.data)) as container:
        packets = [packet for packet in container.demux(video=0) if packet.size]
        assert [packet.is_keyframe for packet in packets] == [True, *[False] * (len(frames) - 1)]
        assert [bytes(packet) for packet in packets] == [stream.data[at : at + size] for at, size in stream.chunks]
    return [np.clip(np.rint((luma - 16.0) * 255 / 219), 0, 255) for luma in frames]


def rgb_from(luma: np.ndarray, chroma: np.ndarray) -> np.ndarray:
    """Return colours (H, W, 3) of luma (H, W) and Cb above Cr (2 H, W), as JPEG mixes them."""
    blue, red = chroma[: len(luma)] - 128, chroma[len(luma) :] - 128
    channels = (luma + 1.402 * red, luma - 0.344136 * blue - 0.714136 * red, luma + 1.772 * blue)
    return np.clip(np.rint(np.stack(channels, axis=-1)), 0, 255)
