"""Procedural and real scenes with what there is to say of them: scale and shift of their relative disparity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from iibr_core.depth.estimates import RelativeInverseDepth
from iibr_core.depth.scaling import disparity_from
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.inpainting.disparity_holes import fill_disparity_holes
from iibr_core.training.batches import PARALLAX_PX
from iibr_core.training.batches import SIZE as TRAINING_SIZE
from iibr_core.training.degradation import add_noise, blur
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import FloatImage, GridShape, ImageSize, ViewOffset

SIZE = ImageSize(56, 64)
PERCENTILES = 1.0, 99.0
FIRST_SEED = 70_000
FLAT_SHARE = 0.05
"""Scenes whose picture shows less of their depth are left out: alpha is near 0 and beta / alpha means nothing."""
OUTERMOST = GridShape(3, 3)
"""Views one step to each side: px per view step are then px in the outermost view."""
REAL = {
    "antinous": ("hci_antinous", "v04_u04", "gt_disp_u04_v04.npy", 4),
    "teddy": ("mb2003_teddy_quarter", "v00_u00", "gt_disp_u00_v00.npy", 1),
    "moebius": ("mb2005_moebius_third", "v00_u00", "gt_disp_u00_v00.npy", 1),
    "motorcycle": ("mb2014_motorcycle_quarter", "v00_u00", "gt_disp_u00_v00.npy", 1),
}
SPLIT = 0.75, 0.85
"""Scenes up to the first share are trained on, those up to the second choose the epoch, the rest are judged."""


class Scenes(NamedTuple):
    """pictures: (N, 4, H, W), photo and relative map. views: (N, 3, H, W), the outermost view to the right.

    truth, rule, known: (N, 2), log2 of alpha and beta / alpha: the true ones, the product's, and the best anyone can
    say who knows the scene itself, but not the cameras' distance and where their zero plane lies.
    """

    pictures: Tensor
    views: Tensor
    truth: Tensor
    rule: Tensor
    known: Tensor

    def part(self, chosen: slice | Tensor) -> Scenes:
        """Some of the scenes."""
        return Scenes(*(values[chosen] for values in self))


def same_picture(count: int = 100) -> Iterator[str]:
    """What becomes of the photo when nothing but the cameras changes."""
    counts, size, here = {11.0: 0, 1.0001: 0}, SIZE, ViewOffset(0.0, 0.0)
    moved = 0
    for seed in range(count):
        scene = random_scene(np.random.default_rng(seed), ImageSize(*size), 1.0)
        photo, _ = render(scene, ImageSize(*size), here)
        moved += not np.array_equal(
            photo, render(replace(scene, infinity_px=scene.infinity_px + 5), ImageSize(*size), here)[0]
        )
        for farther in counts:
            other, _ = render(
                random_scene(np.random.default_rng(seed), ImageSize(*size), farther), ImageSize(*size), here
            )
            counts[farther] += bool(np.abs(photo - other).mean() < 0.1 / 255)
    yield f"The same {count} scenes with cameras 11 times as far apart: {counts[11.0]} photos stay the same, to 0.1"
    yield f"of 255 grey levels on average. With cameras 1.0001 times as far apart {counts[1.0001]} do: patterns of the"
    yield f"others hang on rounding. With another zero plane {count - moved} are the same to the bit."


def normalised(disparity: FloatImage) -> tuple[FloatImage, float, float]:
    """The relative map, alpha and beta; NaN stays NaN."""
    low, high = (float(value) for value in np.nanpercentile(disparity, PERCENTILES))
    alpha = max(high - low, 1e-6)
    return (disparity - np.float32(low)) / np.float32(alpha), alpha, low


def by_rule(relative: FloatImage) -> tuple[float, float]:
    """log2 of alpha and beta / alpha that the product gives a relative map."""
    disparity = disparity_from(RelativeInverseDepth(relative), OUTERMOST) * (100 / relative.shape[1])
    inner = (relative >= 0) & (relative <= 1)
    alpha, beta = np.polyfit(relative[inner].astype(np.float64), disparity[inner], 1)
    return float(np.log2(alpha)), float(beta / alpha)


def procedural(seed: int) -> tuple[FloatImage | tuple[float, float], ...]:
    """One scene with the parallax of T's training: a row of `Scenes`, and what the last column is made from."""
    rng = np.random.default_rng(seed)
    percent = 100 / SIZE[1]
    largest = float(np.exp(rng.uniform(*np.log(PARALLAX_PX)))) * SIZE[1] / TRAINING_SIZE[1]
    scene = random_scene(rng, SIZE, largest)
    colors, disparity = render(scene, SIZE, ViewOffset(0.0, 0.0))
    view, _ = render(scene, SIZE, ViewOffset(0.0, 1.0))
    exact, alpha, beta = normalised(disparity * np.float32(percent))
    relative = add_noise(blur(exact, float(rng.uniform(0.0, 1.0))), rng, float(rng.uniform(0.0, 0.03)), 1.0)
    near, far = (scene.focal_px / z - scene.infinity_px for z in scene.depths)
    span, place = (near - far) * percent, far / (near - far)
    geometry = alpha / span, (beta - far * percent) / span
    return colors, view, relative, (np.log2(alpha), beta / alpha), by_rule(relative), (np.log2(span), place), geometry


def procedural_scenes(count: int) -> Scenes:
    render(random_scene(np.random.default_rng(0), SIZE, 1.0), SIZE, ViewOffset(0.0, 0.0))  # compiles
    rows = (procedural(FIRST_SEED + n) for n in range(count))
    columns = zip(*(row for row in rows if row[-1][0] > FLAT_SHARE), strict=True)
    colors, views, relative, truth, rule, cameras, geometry = (np.asarray(column) for column in columns)
    log_span, place = cameras[: int(SPLIT[0] * len(cameras))].mean(axis=0)
    fill, lowest = geometry.T
    known = np.stack([log_span + np.log2(fill), (place + lowest) / fill], axis=1)
    pictures = np.concatenate([colors, relative[..., None]], axis=3)
    return Scenes(channels_first(pictures), channels_first(views), *map(tensor, (truth, rule, known)))


def real_scene(data: Path, name: str) -> Scenes:
    """A scene of REAL; its true map is the relative one. The picture is as large as the procedural ones."""
    folder, view, disparity_file, radius = REAL[name]
    photo = read_photo(next((data / folder / "views").glob(f"{view}.*")), SIZE[0] * SIZE[1])
    disparity = np.load(data / folder / disparity_file).astype(np.float32)
    relative, alpha, beta = normalised(disparity * np.float32(100 * radius / disparity.shape[1]))
    relative = fill_disparity_holes(resample_surfaces(relative, photo.size))
    picture = channels_first(np.concatenate([photo.pixels, relative[..., None]], axis=2)[None])
    truth, rule = tensor([(np.log2(alpha), beta / alpha)]), tensor([by_rule(relative)])
    return Scenes(picture, picture[:, :3], truth, rule, truth)


def channels_first(pictures: NDArray[np.float32]) -> Tensor:
    return tensor(np.ascontiguousarray(np.moveaxis(pictures, -1, 1)))


def tensor(values: object) -> Tensor:
    return torch.from_numpy(np.asarray(values, np.float32))
