"""Geodesic distance on a picture: the length of the shortest path, where changes of colour count as length, too."""

from __future__ import annotations

from math import sqrt

import numpy as np

from iibr_core.runtime.kernels import kernel


@kernel
def spread_distances(image, pixel_cost, distance):
    """Lower distances (H, W) to those along the shortest paths from all pixels, over 8 neighbours.

    A step costs the change of an image (H, W, C), by the root of the summed squares, and pixel_cost for its length.
    image, distance: float32, contiguous.
    """
    height, width, channels = distance.shape[0], distance.shape[1], image.shape[2]
    straight, diagonal = np.float32(pixel_cost), np.float32(sqrt(2.0) * pixel_cost)
    # Raster scans to and fro (Toivanen 1996), until two in a row change nothing.
    to, unchanged = 1, 0
    while unchanged < 2:
        unchanged += 1
        for row in range(height):
            y = row if to > 0 else height - 1 - row
            for column in range(width):
                x = column if to > 0 else width - 1 - column
                least = distance[y, x]
                # The neighbours that this scan has visited: three in the row before, then beside.
                for n in range(4):
                    v, u = y - to if n < 3 else y, x + n - 1 if n < 3 else x - to
                    if not (0 <= v < height and 0 <= u < width):
                        continue
                    length = distance[v, u] + (straight if u == x or v == y else diagonal)
                    if length < least:
                        change = np.float32(0)
                        for c in range(channels):
                            change += (image[y, x, c] - image[v, u, c]) ** 2
                        least = min(least, length + np.sqrt(change))
                if least < distance[y, x]:
                    distance[y, x] = least
                    unchanged = 0
        to = -to
