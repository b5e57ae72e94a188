"""Photos and views for the table of commands: off-centre, turned, metric, HDR, uneven, several of these at once."""

import json
from pathlib import Path

import numpy as np
from PIL import Image

from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.types import DISPLAY_P3
from tests.iibr_core.scenes import bilinear, smooth_texture

HEIGHT, WIDTH = 48, 72
SQUARE_PX, WALL_PX = 2.0, -1.0
ROWS, COLUMNS, ROW_STEP = 4, 3, 0.5
MARGIN = 12
EXIF_ORIENTATION, EXIF_IFD, GPS_IFD, FOCAL_35MM, ARTIST, MAKER = 0x0112, 0x8769, 0x8825, 0xA405, 0x013B, 0x010F


def seen(t=0.0, s=0.0, height=HEIGHT, width=WIDTH):
    """Return colours (H, W, 3) and disparity of a red square, left of and below the middle, before a slanted wall whose
    right border is nearer, as seen from (t, s), and of a white lamp on the square.
    """
    y, x = np.mgrid[:height, :width].astype(np.float32)
    wall_px = WALL_PX + x / width
    texture = smooth_texture(HEIGHT + 2 * MARGIN, WIDTH + 2 * MARGIN)
    wall = bilinear(texture, y + wall_px * t + MARGIN, x + wall_px * s + MARGIN) * np.float32([0.6, 0.8, 0.9])
    row, column = y + SQUARE_PX * t, x + SQUARE_PX * s
    is_square = (abs(row - 28) < 12) & (abs(column - 26) < 10)
    is_lamp = (abs(row - 24) < 2) & (abs(column - 30) < 2)
    square = bilinear(texture, row + 5, column + 3) * np.float32([1.0, 0.3, 0.2])
    colors = np.where(is_square[..., None], np.where(is_lamp[..., None], 1, square), wall)
    return colors.astype(np.float32), np.where(is_square, SQUARE_PX, wall_px).astype(np.float32)


def write_inputs(folder: Path) -> None:
    """Write every input of the table into a folder."""
    colors, disparity = seen()
    photo = Image.fromarray(np.rint(255 * colors).astype(np.uint8))
    exif = Image.Exif()
    exif[EXIF_ORIENTATION], exif[ARTIST], exif[MAKER] = 6, "Ann", "Maker"
    exif.get_ifd(EXIF_IFD)[FOCAL_35MM] = 40
    exif.get_ifd(GPS_IFD).update({1: "N", 2: (1.0, 2.0, 3.0), 3: "E", 4: (4.0, 5.0, 6.0)})
    side = photo.transpose(Image.Transpose.ROTATE_90)
    side.save(folder / "turned.jpg", exif=exif, icc_profile=icc_profile(DISPLAY_P3), quality=100, subsampling=0)
    metres = np.float32(6) / (disparity - WALL_PX + 1)
    np.save(folder / "turned_depth.npy", metres[::2, ::2])
    write_image(folder / "hdr.exr", np.where(colors > 0.99, 3, colors))
    write_pfm(folder / "hdr_disparity.pfm", disparity)
    photo.save(folder / "bare.png")
    np.save(folder / "narrow.npy", disparity[:, ::2])
    (folder / "photos").mkdir()
    for name, turns in (("a.png", 0), ("b.jpg", 2)):
        Image.fromarray(np.rot90(np.asarray(photo), turns)).save(folder / "photos" / name, quality=95)
    Image.fromarray(np.uint8([[255, 0, 0], [90, 255, 0]])).save(folder / "mask.png")
    (folder / "views").mkdir()
    for row, column in np.ndindex(ROWS, COLUMNS):
        t, s = ROW_STEP * (row - ROWS // 2), column - COLUMNS // 2
        write_image(folder / "views" / f"out_{row:02d}_{column:02d}_{10 * t:.1f}_{10 * s:.1f}.png", seen(t, s)[0])
    (folder / "field").mkdir()
    for row, column in np.ndindex(ROWS, COLUMNS):
        write_image(folder / "field" / f"v{row}_u{column}.png", seen(row - ROWS // 2, column - COLUMNS // 2)[0])
    (folder / "numbered").mkdir()
    for number, (column, row) in enumerate(np.ndindex(COLUMNS, ROWS)):  # column by column, from right to left
        pixels = seen(row - ROWS // 2, COLUMNS - 1 - column - COLUMNS // 2)[0]
        write_image(folder / "numbered" / f"{number:02d}.png", pixels)
    np.save(folder / "field" / "disp_est_u01_v02.npy", disparity)
    left, right = (np.rint(255 * seen(0.0, 2 * s)[0]).astype(np.uint8) for s in (0, 1))
    Image.fromarray(left).save(folder / "left.png")
    Image.fromarray(right).save(folder / "right.png")
    pixels = np.rint(255 * colors).astype(np.uint8)
    Image.fromarray(np.tile(pixels, (2, 3, 1))).save(folder / "q_qs3x2a1.5.png")
    Image.fromarray(np.repeat(np.repeat(pixels, 14, 0), 14, 1)[: 14 * 30]).save(folder / "a_eslf.png")
    Image.fromarray(np.hstack([right, left])).save(folder / "pair.jps", "JPEG", quality=95)
    Image.fromarray(np.vstack([left, right])).save(folder / "x.top-bottom.jpg", quality=95)
    (folder / "gloss.toml").write_text(
        "roughness = 0.4\nreflectance = 0.5\n[surface]\nnearest = 0.6\n[light]\ndirection = [0.2, -0.3, -1]\n"
    )
    (folder / "keys.txt").write_text("0.5 0\n0.5 -1 0.1 0\n-1 0.5 0 2\n")
    cell = {"ROffsetX": -0.3, "ROffsetY": 0.2, "GOffsetX": 0.3, "GOffsetY": 0.2, "BOffsetX": 0, "BOffsetY": -0.2}
    display = {"pitch": 50, "slope": -7, "center": 0.2, "DPI": 300, "screenW": 60, "screenH": 80, "invView": 1,
               "flipImageX": 0, "CellPatternMode": 0, "subpixelCells": [cell]}  # fmt: skip
    wrapped = {key: value if key == "subpixelCells" else {"value": value} for key, value in display.items()}
    (folder / "visual.json").write_text(json.dumps(wrapped))
    poses = [(0, 0, 0), (0.02, 0.01, 0), (0, 0, -0.1)]
    frames = [{"transform_matrix": [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]]} for x, y, z in poses]
    (folder / "poses.json").write_text(json.dumps({"w": WIDTH, "h": HEIGHT, "fl_x": 80, "frames": frames}))
