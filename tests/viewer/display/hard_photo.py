"""A photo that is hard in many ways at once: in linear light beyond white, larger than its views, its views an even
number of rows; colours that no two corners share, and three surfaces, one of them slanted.
"""

import numpy as np

from iibr_core.formats.images.write import write_image
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape

WIDTH, HEIGHT = 192, 128
GRID = GridShape(4, 5)
WALL, BAR, BALL = -1.5, 0.5, 2.0
"""Disparities of the surfaces: the wall behind, a bar that comes nearer to the right by 1, and a ball before both."""


def write_hard_photo(folder):
    """Write the photo and its disparity; return its source, with views of half its size."""
    y, x = np.indices((HEIGHT, WIDTH))
    pixels = np.stack([0.1 + 0.3 * x / WIDTH, 0.1 + 0.3 * y / HEIGHT, 0.15 + 0.1 * ((x // 16 + y // 16) % 2)], axis=-1)
    disparity = np.full((HEIGHT, WIDTH), WALL, np.float32)
    bar, ball = np.s_[84:108], np.hypot(x - 70, y - 50) < 26
    pixels[bar], disparity[bar] = pixels[bar] * (0.3, 1.6, 0.5), BAR + x[bar] / WIDTH
    pixels[ball], disparity[ball] = (0.6, 0.08, 0.05), BALL
    pixels += 4 * np.exp(-((x - 63) ** 2 + (y - 43) ** 2) / 18)[..., None]  # a lamp on the ball
    write_image(folder / "hard.exr", pixels.astype(np.float32))
    np.save(folder / "hard_disparity.npy", disparity)
    return Source(str(folder / "hard.exr"), grid=GRID, focus_disparity=0.5, max_pixels=WIDTH * HEIGHT // 4)
