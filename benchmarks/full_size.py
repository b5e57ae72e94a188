"""Photos at their own size: from opening to the first picture, and pictures saved at that size, each in a process.

python -m benchmarks.full_size [12 24 48] [--save 12]

Seconds on the clock and of the processor, peak memory, and for saved pictures how near they come, made smaller, to the
usual picture. Photos are made up, with a map a quarter as wide.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.harness.report import emit, head, parser_of, row, start
from benchmarks.harness.scenes import MEGAPIXELS, write_photo
from benchmarks.harness.timing import COMMAND_LINE, run
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.evaluation.metrics import psnr
from iibr_core.formats.images.photo import read_photo
from iibr_core.rendering.lens_light import mean_of_areas
from iibr_core.types import image_size

LENSES = {
    "pinhole, in the middle": ("--view", "0,0"),
    "pinhole, aside": ("--view", "1.3,-0.7"),
    "aperture of 81 views' width": ("--aperture", "9"),
}


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("megapixels", nargs="*", type=int, default=[12, 24, 48])
    parser.add_argument("--save", type=int, default=12, choices=list(MEGAPIXELS), help="megapixels of what is saved")
    parser.add_argument("--opened", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.opened is not None:
        first_picture(options.opened)
    else:
        emit(report(options.megapixels, options.save))


def report(sizes: Sequence[int], saved: int) -> Iterator[str]:
    yield head("what", "clock, s", "processor, s", "peak, MiB", "PSNR, dB")
    with tempfile.TemporaryDirectory() as folder:
        photos = {size: write_photo(Path(folder) / f"{size}.jpg", MEGAPIXELS[size]) for size in {*sizes, saved}}
        for size in sizes:
            opening = (sys.executable, "-m", "benchmarks.full_size", "--opened", photos[size])
            yield measured(f"{size} MP: from the start of a process to the first picture", opening)
        full, usual = Path(folder) / "full.png", Path(folder) / "usual.png"
        for name, options in LENSES.items():
            picture = (*COMMAND_LINE, "screenshot", photos[saved], "--force", *options, "-o")
            run((*picture, usual))
            yield measured(f"{saved} MP saved: {name}", (*picture, full, "--full"), (full, usual))


def measured(what: str, command: Sequence[object], pictures: tuple[Path, Path] | None = None) -> str:
    """Run it; a line of the table."""
    ended = run(command)
    if ended.code:
        sys.exit(f"{' '.join(map(str, command))}: ended with {ended.code}")
    near = f"{likeness(*pictures):.1f}" if pictures else ""
    return row(what, f"{ended.cost.wall_s:.1f}", f"{ended.cost.cpu_s:.1f}", f"{ended.peak_mib:.0f}", near)


def first_picture(photo: Path) -> None:
    """Open a photo as the window does, up to its first picture."""
    from iibr_core.scenes.scene import Source
    from viewer.app.headless import HeadlessViewer

    with HeadlessViewer() as viewer:
        viewer.open_scene(Source(str(photo)), 1.0, lambda progress: None)
        viewer.picture()


def likeness(full: Path, usual: Path) -> float:
    """PSNR of the full picture, made smaller, against the usual one."""
    expected = read_photo(usual).pixels
    light = linear_from_srgb(read_photo(full, 10**9).pixels)
    return psnr(srgb_from_linear(mean_of_areas(light, image_size(expected))), expected)


if __name__ == "__main__":
    start("benchmarks.full_size", main)
