"""Light fields whose every view is known, written to disk in the layouts of data sets."""

from pathlib import Path

import numpy as np

from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.types import ViewOffset
from tests.iibr_core.scenes import bilinear, smooth_texture

HEIGHT, WIDTH = 40, 48
FOREGROUND, WALL = 2.0, 0.5
MARGIN = 40


def view_of_wall(offset: ViewOffset, disparity: float = WALL, size: tuple[int, int] = (HEIGHT, WIDTH)) -> np.ndarray:
    """(H, W, 3) of a textured wall seen from an offset: what is at x in the centre is at x - disparity * s."""
    height, width = size
    texture = smooth_texture(height + 2 * MARGIN, width + 2 * MARGIN)
    y = np.arange(height) + MARGIN + disparity * offset.t
    x = np.arange(width) + MARGIN + disparity * offset.s
    return np.asarray(bilinear(texture, *np.meshgrid(y, x, indexing="ij")), np.float32)


def view_of_square(offset: ViewOffset) -> np.ndarray:
    """(H, W, 3) of a reddish square at FOREGROUND before the wall; offsets at which it moves by whole pixels."""
    pixels = view_of_wall(offset) * np.float32([0.4, 0.6, 1.0])
    top, left = round(HEIGHT / 3 - FOREGROUND * offset.t), round(WIDTH / 3 - FOREGROUND * offset.s)
    square = np.s_[top : top + HEIGHT // 3, left : left + WIDTH // 3]
    own = (smooth_texture(HEIGHT, WIDTH, 1) * np.float32([1.0, 0.4, 0.2]))[: HEIGHT // 3, : WIDTH // 3]
    pixels[square] = own[: pixels[square].shape[0], : pixels[square].shape[1]]
    return pixels


def disparity_of_square() -> np.ndarray:
    disparity = np.full((HEIGHT, WIDTH), WALL, np.float32)
    top, left = round(HEIGHT / 3), round(WIDTH / 3)
    disparity[top : top + HEIGHT // 3, left : left + WIDTH // 3] = FOREGROUND
    return disparity


def offsets_of(rows: int, columns: int) -> dict[tuple[int, int], ViewOffset]:
    """Offsets by (v, u), from the centre view."""
    return {(v, u): ViewOffset(float(v - rows // 2), float(u - columns // 2)) for v, u in np.ndindex(rows, columns)}


def write_grid(folder: Path, side: int = 3) -> Path:
    """views/v00_u00.png .. and gt_disp_uUU_vVV.npy of the square."""
    (folder / "views").mkdir(parents=True)
    for (v, u), offset in offsets_of(side, side).items():
        write_image(folder / "views" / f"v{v:02d}_u{u:02d}.png", view_of_square(offset))
    np.save(folder / f"gt_disp_u{side // 2:02d}_v{side // 2:02d}.npy", disparity_of_square())
    return folder


def write_hci(folder: Path, rows: int = 3, columns: int = 3) -> Path:
    """input_Cam000.png .. row by row, gt_disp_lowres.pfm, parameters.cfg."""
    folder.mkdir(parents=True)
    for (v, u), offset in offsets_of(rows, columns).items():
        write_image(folder / f"input_Cam{v * columns + u:03d}.png", view_of_square(offset))
    write_pfm(folder / "gt_disp_lowres.pfm", disparity_of_square())
    (folder / "parameters.cfg").write_text(f"[extrinsics]\nnum_cams_x = {columns}\nnum_cams_y = {rows}\n")
    return folder


def write_numbered(folder: Path, names: dict[str, ViewOffset], size: tuple[int, int] = (8, 8)) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, offset in names.items():
        write_image(folder / name, view_of_wall(offset, size=size))
    return folder


def write_llff_row(folder: Path) -> Path:
    write_numbered(folder / "images", {f"IMG_{n}.png": ViewOffset(0, n) for n in range(3)}, (HEIGHT, WIDTH))
    down, right, back = np.eye(3)[[1, 0, 2]] * [[1], [1], [-1]]
    poses = [np.column_stack([down, right, back, [n, 0, 0], [HEIGHT, WIDTH, 50]]).ravel() for n in range(3)]
    np.save(folder / "poses_bounds.npy", np.array([[*pose, 5.0, 50.0] for pose in poses]))
    return folder
