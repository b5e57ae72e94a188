"""Comparing pictures with named tolerances. A failure writes the two pictures and their difference beside each other.

A tolerance has three parts, as image test suites of renderers do it: how far a channel may be off, how many pixels may
be farther off than that, and how far at most.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from tests.golden_rows import FOLDER


@dataclass(frozen=True)
class Tolerance:
    """per_channel and hard_limit in steps of 1/255; share_beyond is the share of pixels that may exceed per_channel."""

    per_channel: int
    share_beyond: float
    hard_limit: int


EXACT = Tolerance(0, 0.0, 0)
ROUNDING = Tolerance(1, 0.0, 1)
"""Two ways to compute the same number."""
FILTERING = Tolerance(2, 0.0, 3)
"""The same with texture filtering of 8-bit values in between."""
SAME_RASTERISER = Tolerance(2, 0.002, 24)
"""Golden images: another version of the software rasteriser may decide a depth edge differently here and there."""
DECISIONS = Tolerance(2, 0.002, 255)
"""Golden maps: another processor may give a pixel here and there to the other side of an edge."""
MATCHED = Tolerance(4, 0.03, 255)
"""Golden maps of matched views: rounding decides between matches of nearly equal cost at more pixels."""

DEPTH_EDGES = Tolerance(2, 0.004, 255)
"""The same for hard scenes, where a pixel beside an edge may show the surface before or behind it."""

OTHER_PROCESSOR = Tolerance(1, 0.0008, 255)
"""Golden pictures of the core: another processor rounds differently, which may turn a decision here and there."""


def problem_with(image: NDArray[np.uint8], expected: NDArray[np.uint8], tolerance: Tolerance) -> str | None:
    """What is wrong with an (H, W, 3) image, or None."""
    if image.shape != expected.shape:
        return f"shape {image.shape}, expected {expected.shape}"
    difference = np.abs(image.astype(int) - expected).max(axis=-1)
    share = float(np.mean(difference > tolerance.per_channel))
    if share > tolerance.share_beyond or difference.max() > tolerance.hard_limit:
        return f"off by up to {difference.max()}/255, {share:.2%} of pixels beyond {tolerance.per_channel}/255"
    return None


def assert_close(image, expected, tolerance, folder, name="image"):
    """Fail where the images differ; `folder/name-diff.png` then shows image, expected and 8 times their difference."""
    problem = problem_with(image, expected, tolerance)
    if problem is None:
        return
    place = folder / f"{name}-diff.png"
    if image.shape == expected.shape:
        difference = np.clip(np.abs(image.astype(int) - expected) * 8, 0, 255).astype(np.uint8)
        write_png(place, np.concatenate([image, expected, difference], axis=1))
    else:
        write_png(place, image)
    raise AssertionError(f"{name}: {problem}; see {place}")


def assert_golden(
    image: NDArray[np.uint8],
    name: str,
    tolerance: Tolerance,
    folder: Path,
    regenerate: bool,
    tile: tuple[int, int] | None = None,
) -> None:
    """Compare an (H, W, 3) image with `tests/golden/NAME.png`, or write it there.

    tile: height and width of the parts of a sheet, each of which is compared by itself; None: the whole is.
    """
    path = FOLDER / f"{name}.png"
    if regenerate:
        write_png(path, image)
    expected, (height, width) = read_png(path), tile or image.shape[:2]
    assert image.shape == expected.shape, f"{name}: shape {image.shape}, expected {expected.shape}"
    for row, column in np.ndindex(-(-image.shape[0] // height), -(-image.shape[1] // width)):
        part = np.s_[row * height : (row + 1) * height, column * width : (column + 1) * width]
        words = path.stem if tile is None else f"{path.stem}, row {row + 1}, column {column + 1}"
        assert_close(image[part], expected[part], tolerance, folder, words)


def write_png(path: Path, image: NDArray[np.uint8]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    height, width, channels = image.shape
    buffer = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, oiio.UINT8))
    buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(image))
    assert buffer.write(str(path)), buffer.geterror()


def read_png(path: Path) -> NDArray[np.uint8]:
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8))[..., :3]
