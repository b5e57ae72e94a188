"""Ways to damage the bytes of a file: bits, numbers, lengths, order, parts of others."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

MOST_BYTES = 1 << 20

Rng = np.random.Generator


@dataclass(frozen=True)
class Seed:
    """A valid file: its name, the bytes that are damaged, and what makes a file of them."""

    name: str
    data: bytes
    file_of: Callable[[bytes], bytes] = bytes


def damage(seeds: list[Seed], rng: Rng) -> tuple[str, bytes]:
    """File name and bytes of one of the seeds, damaged in one way or in several."""
    chosen = seeds[rng.integers(len(seeds))]
    data = chosen.data
    for _ in range(min(rng.geometric(0.5), 8)):
        data = DAMAGES[rng.integers(len(DAMAGES))](data, seeds, rng)[:MOST_BYTES]
    try:
        return chosen.name, chosen.file_of(data)
    except (ValueError, OverflowError, struct.error, SyntaxError, OSError):
        return chosen.name, data  # not even a file can be made of it


def repair_png(data: bytes) -> bytes:
    """The same chunks with lengths and checksums that are right, so that damage gets past the first look."""
    at, chunks = 8, [data[:8]]
    while at + 8 <= len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        content = data[at + 8 : at + 8 + length]
        chunks.append(struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content)))
        at += 12 + length
    return b"".join(chunks)


NUMBERS = (b"-1", b"0", b"1e999", b"nan", b"-inf", b"99999999999999999999", b"4294967295", b"65536", b"0.0", b"1e-320")
EXTREMES = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def _span(data: bytes, rng: Rng) -> tuple[int, int]:
    first = int(rng.integers(len(data) + 1))
    return first, min(first + int(2 ** rng.uniform(0, 10)), len(data))


def _flip(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    changed = bytearray(data)
    for at in rng.integers(max(len(data), 1), size=rng.integers(1, 9)):
        if data:
            changed[at] ^= 1 << rng.integers(8)
    return bytes(changed)


def _extreme(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    """A whole number at some place becomes one that programs trip over; headers come first, so early places more."""
    at = int(len(data) * rng.random() ** 3)
    width, order = (1, 2, 4)[rng.integers(3)], ("big", "little")[rng.integers(2)]
    value = EXTREMES[rng.integers(len(EXTREMES))] & (256**width - 1)
    return data[:at] + value.to_bytes(width, order) + data[at + width :]


def _cut(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    return data[: int(rng.integers(len(data) + 1))]


def _delete(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    first, last = _span(data, rng)
    return data[:first] + data[last:]


def _repeat(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    first, last = _span(data, rng)
    return data[:first] + data[first:last] * int(2 ** rng.uniform(1, 12)) + data[last:]


def _insert(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    at, _ = _span(data, rng)
    return data[:at] + rng.bytes(int(2 ** rng.uniform(0, 8))) + data[at:]


def _splice(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    other = seeds[rng.integers(len(seeds))].data
    first, last = _span(other, rng)
    at, end = _span(data, rng)
    return data[:at] + other[first:last] + data[end:]


def _number(data: bytes, seeds: list[Seed], rng: Rng) -> bytes:
    """A number written out, of a header or a text, becomes another."""
    places = [match.span() for match in re.finditer(rb"(?<![0-9A-Za-z+/])-?\d{1,12}(\.\d{1,12})?", data[:20_000])]
    if not places:
        return _extreme(data, seeds, rng)
    first, last = places[rng.integers(len(places))]
    return data[:first] + NUMBERS[rng.integers(len(NUMBERS))] + data[last:]


DAMAGES = (_flip, _flip, _extreme, _extreme, _cut, _delete, _repeat, _insert, _splice, _number, _number)
