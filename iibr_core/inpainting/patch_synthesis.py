"""Patch synthesis: gives smoothly filled holes the texture of their surface. From the border inwards, each patch is
copied from the most similar place around it (Efros & Leung, 1999; Criminisi et al., 2004).

A patch that fits the known pixels is copied unchanged, which continues lines; deeper in a hole, and where no patch
fits, only its fine texture is copied, whose place does not matter. Patches are copied within one surface only. They
overlap, and a pixel gets the mean of all patches over it (Wexler et al., 2007): seams would look like grain.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces, pieces_of
from iibr_core.surfaces import same_surface
from iibr_core.types import FloatImage, ImageSize, image_size

RADIUS_PX = 3
"""Radius of a patch: patches are 7 x 7 pixels."""
SEARCH_PX, STEP_PX = 32, 4
"""Distance and spacing, in pixels, of the places that are searched; then follows the surroundings of the best."""
GUESS = np.float32(0.6)
"""Weight of a smoothly filled pixel in the comparison of patches; known and copied pixels have 1."""
MISSING = np.float32(0.1)
"""Squared colour difference of a pixel whose surface is missing in the place it is compared with."""
FIT = np.float32(0.1)
"""Root mean square difference from the known pixels at which a patch is hardly trusted."""
MAX_TEXTURE = np.float32(0.05)
"""Largest texture, as a difference of colours, that is copied from a patch without trust."""
MIN_TRUST = np.float32(1e-6)
"""Least trust in a copied pixel."""
FIRST_PATCH_WEIGHT = np.float32(3.0)
"""Weight of the first patch over a pixel in the mean; the following ones have 1."""
FINE_TEXTURE_PX = 5
"""Radius in pixels of the mean from which texture differs."""
PATCH_BLOCK_PX = 64
"""Side in pixels of the blocks that are filled in threads, never two that touch."""


def copy_patches(
    colors: FloatImage,
    disparity: FloatImage,
    hole: NDArray[np.bool_],
    pixels: NDArray[np.int64],
    number: NDArray[np.int32],
    one_surface: float,
    threads: int,
) -> None:
    """Add texture to the smoothly filled pixels of holes (H, W), in place.

    colors: (H, W, 3). disparity: (H, W). pixels, number: see `AroundHoles`. one_surface: largest difference of
    disparities on one surface.
    """
    smooth = np.take(colors.reshape(-1, 3), pixels, axis=0)
    trust = np.zeros(len(pixels), np.float32)
    shown = np.zeros((len(pixels), 4), np.float32)
    for blocks in _blocks_apart(pixels, image_size(hole)):
        in_pieces(
            lambda block: _copy_block(colors, disparity, hole, number, block, np.float32(one_surface), trust, shown),
            blocks, threads,
        )  # fmt: skip
    counts = shown[:, 3:]
    change = np.where(counts > 0, shown[:, :3] / np.maximum(counts, 1) - smooth, np.float32(0.0))
    in_pieces(
        lambda part: _blend(hole, number, pixels, part.start, smooth, change, trust, colors),
        pieces_of(len(pixels), PATCH_BLOCK_PX**2), threads,
    )  # fmt: skip


def _blocks_apart(pixels: NDArray[np.int64], size: ImageSize) -> list[list[tuple[int, int]]]:
    """Return row and column of all blocks with these pixels, in four lists of blocks that do not touch."""
    columns = -(-size.width // PATCH_BLOCK_PX)
    y, x = np.divmod(pixels, size.width)
    is_found = np.zeros((-(-size.height // PATCH_BLOCK_PX), columns), np.bool_)
    is_found[y // PATCH_BLOCK_PX, x // PATCH_BLOCK_PX] = True
    found = [(int(row), int(column)) for row, column in np.argwhere(is_found)]
    return [
        [block for block in found if (block[0] % 2, block[1] % 2) == odd] for odd in ((0, 0), (1, 1), (0, 1), (1, 0))
    ]


@kernel
def _copy_block(colors, disparity, hole, number, block, one_surface, trust, shown):
    """Copy patches into the holes of a block (row, column).

    trust (N,): trust in each hole pixel, 0 before it is copied. shown (N, 4): weighted sum of the patches over each
    hole pixel, and the sum of their weights.
    """
    height, width = number.shape
    top, left = block[0] * PATCH_BLOCK_PX, block[1] * PATCH_BLOCK_PX
    bottom, right = min(top + PATCH_BLOCK_PX, height), min(left + PATCH_BLOCK_PX, width)
    queue, end = np.empty(PATCH_BLOCK_PX**2, np.int64), 0
    is_queued = np.zeros((PATCH_BLOCK_PX, PATCH_BLOCK_PX), np.bool_)
    # First the pixels beside known ones of their surface, then those around each patch.
    for y in range(top, bottom):
        for x in range(left, right):
            if not hole[y, x]:
                continue
            for v, u in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
                if 0 <= v < height and 0 <= u < width and not is_queued[y - top, x - left]:
                    is_known = not hole[v, u] or trust[number[v, u]] > 0
                    if is_known and same_surface(disparity[v, u], disparity[y, x], one_surface):
                        queue[end], end = y * width + x, end + 1
                        is_queued[y - top, x - left] = True
    tap = np.empty(((2 * RADIUS_PX + 1) ** 2, 2), np.int64)
    patch = np.empty((len(tap), 5), np.float32)
    first = 0
    while first < end:
        y, x = queue[first] // width, queue[first] % width
        first += 1
        if trust[number[y, x]] > 0:
            continue
        taps, trusted = _take_patch(colors, disparity, hole, number, y, x, one_surface, trust, tap, patch)
        source_y, source_x, unlike = _find_place(colors, disparity, hole, y, x, one_surface, tap[:taps], patch[:taps])
        if source_y < 0:
            continue
        # The trust in the pixels that it continues, less where it does not fit them.
        patch_trust = max(np.float32(trusted * np.exp(-unlike / FIT**2)), MIN_TRUST)
        for k in range(taps):
            v, u, a, b = y + tap[k, 0], x + tap[k, 1], source_y + tap[k, 0], source_x + tap[k, 1]
            if not hole[v, u] or hole[a, b] or not same_surface(disparity[a, b], patch[k, 3], one_surface):
                continue
            i, count = number[v, u], np.float32(1.0)
            if trust[i] == 0:
                # The following patches are compared with this one.
                colors[v, u] = colors[a, b]
                trust[i], count = patch_trust, FIRST_PATCH_WEIGHT
            for c in range(3):
                shown[i, c] += count * colors[a, b, c]
            shown[i, 3] += count
        for v in range(max(y - RADIUS_PX - 1, top), min(y + RADIUS_PX + 2, bottom)):
            for u in range(max(x - RADIUS_PX - 1, left), min(x + RADIUS_PX + 2, right)):
                if not hole[v, u] or trust[number[v, u]] > 0 or is_queued[v - top, u - left]:
                    continue
                if same_surface(disparity[v, u], disparity[y, x], one_surface):
                    queue[end], end = v * width + u, end + 1
                    is_queued[v - top, u - left] = True


@kernel
def _take_patch(colors, disparity, hole, number, y, x, one_surface, trust, tap, patch):
    """Write the pixels of a patch on the surface of its middle: place, tap (M, 2); colour, disparity and weight, patch
    (M, 5). Return M and the mean trust in those that are not smoothly filled, which is 1 for known pixels.
    """
    height, width = number.shape
    taps, counted, total = 0, 0, np.float32(0.0)
    for v in range(max(y - RADIUS_PX, 0), min(y + RADIUS_PX + 1, height)):
        for u in range(max(x - RADIUS_PX, 0), min(x + RADIUS_PX + 1, width)):
            if same_surface(disparity[v, u], disparity[y, x], one_surface):
                here = trust[number[v, u]] if hole[v, u] else np.float32(1.0)
                tap[taps, 0], tap[taps, 1] = v - y, u - x
                patch[taps, 0], patch[taps, 1], patch[taps, 2] = colors[v, u, 0], colors[v, u, 1], colors[v, u, 2]
                patch[taps, 3], patch[taps, 4] = disparity[v, u], np.float32(1.0) if here > 0 else GUESS
                taps, counted, total = taps + 1, counted + (1 if here > 0 else 0), total + here
    return taps, total / max(counted, 1)


@kernel
def _find_place(colors, disparity, hole, y, x, one_surface, tap, patch):
    """Return row and column of the most similar place of the surface, -1 without any, and the mean square of its
    difference from the patch's known and copied pixels.
    """
    height, width = hole.shape
    side, around = 2 * (SEARCH_PX // STEP_PX) + 1, 2 * STEP_PX - 1
    best, best_y, best_x, middle_y, middle_x = np.float32(np.inf), -1, -1, -1, -1
    for k in range(side**2 + around**2):
        if k < side**2:
            v, u = y + (k // side) * STEP_PX - SEARCH_PX, x + (k % side) * STEP_PX - SEARCH_PX
            middle_y, middle_x = best_y, best_x
        else:
            j = k - side**2
            v, u = middle_y + j // around - STEP_PX + 1, middle_x + j % around - STEP_PX + 1
        if not (RADIUS_PX <= v < height - RADIUS_PX and RADIUS_PX <= u < width - RADIUS_PX):
            continue
        if hole[v, u] or not same_surface(disparity[v, u], disparity[y, x], one_surface):
            continue
        unlike = np.float32(0.0)
        for m in range(len(tap)):
            # Within the frame: unsigned indices need no test for counting from the end.
            a, b = np.uint64(v + tap[m, 0]), np.uint64(u + tap[m, 1])
            if not hole[a, b] and same_surface(disparity[a, b], patch[m, 3], one_surface):
                red, green = colors[a, b, 0] - patch[m, 0], colors[a, b, 1] - patch[m, 1]
                blue = colors[a, b, 2] - patch[m, 2]
                unlike += patch[m, 4] * (red * red + green * green + blue * blue)
            else:
                unlike += patch[m, 4] * MISSING
            # No better than the best so far.
            if unlike >= best:
                break
        if unlike < best:
            best, best_y, best_x = unlike, v, u
    unlike, total = np.float32(0.0), 0
    for m in range(len(tap)):
        a, b = best_y + tap[m, 0], best_x + tap[m, 1]
        if best_y >= 0 and patch[m, 4] == 1:
            total += 1
            if not hole[a, b] and same_surface(disparity[a, b], patch[m, 3], one_surface):
                for c in range(3):
                    unlike += (colors[a, b, c] - patch[m, c]) ** 2
            else:
                unlike += MISSING
    return best_y, best_x, unlike / max(total, 1)


@kernel
def _blend(hole, number, pixels, first, smooth, change, trust, colors):
    """Write up to PATCH_BLOCK_PX^2 hole pixels from `first` on.

    smooth (N, 3): their smooth colours. change (N, 3): difference of the patches from these. trust (N,): share of the
    change that is taken; the rest is reduced to its fine texture.
    """
    height, width = number.shape
    mean, fine = np.empty(4, np.float32), np.empty(3, np.float32)
    for i in range(first, min(first + PATCH_BLOCK_PX**2, len(pixels))):
        y, x = pixels[i] // width, pixels[i] % width
        mean[:] = 0.0
        for v in range(max(y - FINE_TEXTURE_PX, 0), min(y + FINE_TEXTURE_PX + 1, height)):
            for u in range(max(x - FINE_TEXTURE_PX, 0), min(x + FINE_TEXTURE_PX + 1, width)):
                if hole[v, u]:
                    mean[3] += 1
                    for c in range(3):
                        mean[c] += change[number[v, u], c]
        most = np.float32(0.0)
        for c in range(3):
            fine[c] = change[i, c] - mean[c] / mean[3]
            most = max(most, abs(fine[c]))
        scale, share = MAX_TEXTURE / max(most, MAX_TEXTURE), trust[i]
        for c in range(3):
            changed = share * change[i, c] + (1 - share) * scale * fine[c]
            colors[y, x, c] = max(smooth[i, c] + changed, np.float32(0.0))
