"""Judge refocused pictures: against an exact lens, and against many pinhole cameras.

    python -m benchmarks lens [--seeds 1,2] [--discs 12,36,72] [--cameras 1024] [--photo FILE]

Drawn scenes have three flat surfaces, one step of disparity apart: a wall with lamps, a ragged disc and bars. The truth
is the mean over lens points one pixel of blur apart. Open: no edge within reach; edges: the rest; both are the least of
the three focus planes, in dB. Time is that of processors. The photo is judged against the sum of --cameras views,
`LightField.refocus`, with discs of 4, 8 and 15 % of the width.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

import iibr_core
from benchmarks.report import ROOT, markdown
from iibr_core.beyond.optics import Optics
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.evaluation.metrics import psnr
from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.interface.public_scene import PhotoScene
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.scenes.lens_limits import aperture_of_disc
from iibr_core.scenes.scene import Source
from iibr_core.types import FloatImage, ImageSize, InputError
from viewer.display.offscreen import OffscreenScene

SIZE, MARGIN = ImageSize(320, 480), 80
"""Size of the picture, and of the surfaces around it: the widest disc that can be judged."""
FOCI = (-1, 0, 1)
SHARES = (0.04, 0.08, 0.15)
LAMPS = 20
MIN_JUDGED = 500
"""Smallest number of pixels that are judged."""


@dataclass(frozen=True, eq=False)
class Layers:
    """Flat surfaces from far to near, with MARGIN around the picture. light (3, H, W, 3), opacity (3, H, W)."""

    light: FloatImage
    opacity: FloatImage

    def seen(self, disc: int, focus: int) -> FloatImage:
        """Return the picture (H, W, 3) through a lens, sRGB-encoded. disc: px for surfaces one step apart."""
        at = np.arange(-(disc // 2), disc // 2 + 1)
        points = np.array([(t, s) for t in at for s in at if t * t + s * s <= disc * disc / 4])
        light = np.empty((*SIZE, 3), np.float32)
        moves = np.array([k - focus for k in FOCI])
        in_bands(lambda *rows: _add_up(self.light, self.opacity, moves, points, MARGIN, rows, light), SIZE)
        return srgb_from_linear(light)


@kernel
def _add_up(light, opacity, moves, points, margin, rows, result):
    """Write rows [first, last) of the mean over lens points (N, 2) of the layers, composited from near to far."""
    for y in range(*rows):
        for x in range(result.shape[1]):
            red = green = blue = 0.0
            for i in range(len(points)):
                passed = 1.0
                for k in range(len(moves) - 1, -1, -1):
                    v, u = y + margin + moves[k] * points[i, 0], x + margin + moves[k] * points[i, 1]
                    share = passed * opacity[k, v, u]
                    if share > 0:
                        red += share * light[k, v, u, 0]
                        green += share * light[k, v, u, 1]
                        blue += share * light[k, v, u, 2]
                        passed -= share
                        if passed < 1e-4:
                            break
            result[y, x, 0], result[y, x, 1], result[y, x, 2] = (
                red / len(points),
                green / len(points),
                blue / len(points),
            )


def drawn(seed: int) -> Layers:
    """Return a scene: soft noise of all sizes on a wall with lamps, a ragged disc and bars."""
    rng, (rows, columns) = np.random.default_rng(seed), (SIZE.height + 2 * MARGIN, SIZE.width + 2 * MARGIN)
    encoded = np.stack([_texture(rng, rows, columns) for _ in FOCI])
    for x, y in rng.integers((0, 0), (columns, rows), (LAMPS, 2)).tolist():
        cv2.circle(encoded[0], (x, y), 2, (1, 1, 1), -1, cv2.LINE_AA)
    y, x = np.mgrid[:rows, :columns].astype(np.float32)
    down, right = y - rows * rng.uniform(0.4, 0.6), x - columns * rng.uniform(0.4, 0.6)
    angle, turn = np.arctan2(down, right), rng.uniform(0, 6, 2)
    rim = SIZE.height * 0.3 + 4 * np.sin(7 * angle + turn[0]) + 2 * np.sin(29 * angle + turn[1])
    bars = np.full_like(x, -9.0)
    for place in rng.uniform(0.1, 0.9, 3):
        slope, half = rng.uniform(-0.2, 0.2), rng.uniform(5, 20)
        bars = np.maximum(bars, half - np.abs(x - place * columns - slope * down))
    edges = [np.ones_like(x), np.clip(rim - np.hypot(down, right) + 0.5, 0, 1), np.clip(bars + 0.5, 0, 1)]
    return Layers(linear_from_srgb(encoded), np.float32(edges))


def _texture(rng: np.random.Generator, rows: int, columns: int) -> FloatImage:
    picture = np.full((rows, columns, 3), rng.uniform(0.3, 0.6, 3))
    for cells, contrast in ((4, 0.2), (16, 0.12), (64, 0.08), (256, 0.05)):
        noise = rng.normal(0, contrast, (cells, cells, 3))
        picture += cv2.resize(noise, (columns, rows), interpolation=cv2.INTER_CUBIC)
    return np.clip(picture, 0, 1).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Judge:
    """Judges pictures with discs of this size and focus. shown (H, W): number of the surface that a pixel shows."""

    shown: np.ndarray
    truth: FloatImage
    disc: int
    focus: int

    def __call__(self, picture: FloatImage) -> tuple[float, float]:
        """Return dB in the open and at edges, NaN where too few pixels are judged."""
        steps = max(1, *(abs(k - self.focus) for k in FOCI))
        reach = self.disc * steps // 2 + 3
        edge = cv2.morphologyEx(self.shown.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2)
        beside, inner = cv2.dilate(np.uint8(edge > 0), disc) > 0, np.zeros(SIZE, np.bool_)
        inner[reach:-reach, reach:-reach] = True
        return self._db(picture, ~beside & inner), self._db(picture, beside & inner)

    def _db(self, picture: FloatImage, mask: np.ndarray) -> float:
        return psnr(picture[mask], self.truth[mask]) if mask.sum() > MIN_JUDGED else np.nan


def exact_rows(seed: int, discs: list[int]) -> list[tuple[object, ...]]:
    """Return a row of the table for each disc in a drawn scene."""
    scene, rows = drawn(seed), list[tuple[object, ...]]()
    photo, inner = scene.seen(0, 0), np.s_[MARGIN:-MARGIN, MARGIN:-MARGIN]
    shown = np.where(scene.opacity[2][inner] > 0.5, 2, np.where(scene.opacity[1][inner] > 0.5, 1, 0))
    with tempfile.TemporaryDirectory() as folder, OffscreenScene() as viewer:
        path = Path(folder) / "scene.png"
        write_image_file(path, np.rint(65535 * photo).astype(np.uint16), "uint16")
        write_pfm(path.with_name("scene_disparity.pfm"), np.float32(shown - 1))
        plan = viewer.open(Source(str(path))).plan
        assert plan is not None
        for disc in discs:
            judged, seconds = [], 0.0
            for focus in FOCI:
                sharp = (focus - plan.disparity_zero) * plan.disparity_scale
                optics = Optics(focus_disparity=sharp, aperture_diameter=disc / plan.disparity_scale)
                judge, begun = Judge(shown, scene.seen(disc, focus), disc, focus), time.process_time()
                picture = _picture(viewer, optics)
                seconds += time.process_time() - begun
                judged.append(judge(picture))
            least = (f"{np.nanmin(values):.1f}" for values in zip(*judged))
            rows.append((f"drawn {seed}", f"{disc} px", *least, f"{seconds / len(FOCI):.2f} s"))
    return rows


def _picture(viewer: OffscreenScene, optics: Optics) -> FloatImage:
    viewer.state = replace(viewer.state, optics=optics)
    return srgb_from_linear(viewer.picture(is_linear=True))


def settled_rows(path: Path, cameras: int) -> list[tuple[object, ...]]:
    """Return a row of the table for each width of discs, against many cameras."""
    photo, rows = iibr_core.open(path), list[tuple[object, ...]]()
    assert isinstance(photo, PhotoScene)
    field = photo.light_field()
    with OffscreenScene() as viewer:
        scene = viewer.open(Source(str(path)))
        focus = scene.subject_disparity_px
        for share in SHARES:
            aperture = aperture_of_disc(scene, share)
            picture = np.clip(_picture(viewer, Optics(focus_disparity=focus, aperture_diameter=aperture)), 0, 1)
            summed = np.clip(field.refocus(focus, aperture, cameras), 0, 1)
            rows.append((path.stem, f"{share:.0%}", f"{psnr(picture, summed):.1f}"))
    return rows


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1,2")
    parser.add_argument("--discs", default="12,36,72")
    parser.add_argument("--cameras", type=int, default=1024)
    parser.add_argument("--photo", type=Path, default=ROOT / "assets" / "motorcycle" / "motorcycle.png")
    options = parser.parse_args()
    discs = [int(disc) for disc in options.discs.split(",")]
    if max(discs) > MARGIN:
        raise InputError(f"--discs {options.discs}: give discs of at most {MARGIN} px")
    names = ("scene", "disc", "open, dB", "edges, dB", "a picture")
    print(markdown(names, (row for seed in options.seeds.split(",") for row in exact_rows(int(seed), discs))))
    print()
    names = ("photo", "widest disc", f"dB against {options.cameras} cameras")
    print(markdown(names, settled_rows(options.photo, options.cameras)))


if __name__ == "__main__":
    main()
