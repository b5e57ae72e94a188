"""Light fields of every layout, hard ones, and cameras, as people get them: compared with `tests/golden/fields`."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.color import bytes_from_encoded, linear_from_srgb
from iibr_core.formats.cameras import FieldCameras, write_llff
from iibr_core.formats.colmap import write_colmap
from iibr_core.formats.images.write import write_image, write_image_file
from iibr_core.formats.light_fields.write import LENSLET_KEY
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.quilts import Quilt, lay_out
from iibr_core.types import GridShape, ImageSize, ViewOffset
from tests.iibr_core.facts import require_golden
from tests.iibr_core.formats.opened import camera_poses, field_facts
from tests.iibr_core.hard_scenes import TURNED, blocks, lying, write_hard_field

SIZE = ImageSize(24, 32)
WIDE = blocks(3, 80, 96)
Write = Callable[[Path], Any]


def view(t: float, s: float) -> np.ndarray:
    """Return a plane of disparity 2 seen from an offset, (H, W, 3) bytes."""
    top, left = round(24 + 2 * t), round(32 + 2 * s)
    return bytes_from_encoded(WIDE[top : top + SIZE.height, left : left + SIZE.width].astype(np.float32))


def write_views(folder: Path, names: dict[str, tuple[float, float]], orientation: int = 1) -> Path:
    """Write pictures by their names and offsets; turned ones are stored lying on their side."""
    folder.mkdir(parents=True, exist_ok=True)
    exif = Image.Exif()
    exif[0x0112] = orientation
    for name, at in names.items():
        pixels = view(*at) if orientation == 1 else lying(view(*at))
        options = {"quality": 98, "subsampling": 0} if name.endswith("jpg") else {}
        Image.fromarray(pixels).save(folder / name, **options, **({"exif": exif} if orientation > 1 else {}))
    return folder


def named(pattern: str, rows: Iterable[int], columns: Iterable[int], first: int = 0) -> dict[str, tuple[float, float]]:
    """Return names of a grid's views: v, u are row and column, k is the number row by row."""
    rows, columns = list(rows), list(columns)
    places = [(k, v, u) for k, (v, u) in enumerate((v, u) for v in rows for u in columns)]
    return {pattern.format(v=v, u=u, k=k + first, d=columns[-1] - u): (v, u) for k, v, u in places}


def write_map(path: Path, value: float = 2.0) -> None:
    """Write a map of the plane, farther at its left border."""
    values = np.full(SIZE, value, np.float32)
    values[:, :4] = value - 1
    np.save(path, values) if path.suffix == ".npy" else write_pfm(path, values)


def hci(folder: Path) -> None:
    """Write 3 x 5 views as OpenEXR, maps of some, and the parameters of a camera."""
    for name, at in named("input_Cam{k:03d}.exr", range(3), range(5)).items():
        write_image_file(folder / name, linear_from_srgb(1.5 * view(*at) / np.float32(255)), "float")
    for name, value in (("gt_disp_lowres.pfm", 2), ("disp_Cam000.pfm", 2.5), ("gt_disp_lowres_Cam014.pfm", 1.5)):
        write_map(folder / name, value)
    Image.new("RGB", (9, 9)).save(folder / "objectids_highres.png")
    lens, more = "focal_length_mm = 100\nsensor_size_mm = 35\n", "baseline_mm = 60\nfocus_distance_m = 6.9\n"
    text = f"[intrinsics]\n{lens}[extrinsics]\nnum_cams_x = 5\nnum_cams_y = 3\n{more}[meta]\ndisp_min = nan\n"
    (folder / "parameters.cfg").write_text(text)


def with_parameters(write: Write, text: str) -> Write:
    def write_both(folder: Path) -> None:
        write(folder)
        (folder / "parameters.cfg").write_text(f"[a]\n{text}")

    return write_both


def grid_with_maps(folder: Path) -> None:
    """Write every second view of a numbered grid, an estimate and a map of the middle."""
    write_views(folder / "views", named("v{v:02d}_u{u:02d}.png", range(1, 8, 2), range(0, 9, 2)))
    write_map(folder / "disp_est_u01_v00.npy", 3.0)
    write_map(folder / "gt_disp_u02_v02.npy")


def star(folder: Path) -> None:
    places = [(v, u) for v, u in np.ndindex(7, 7) if 3 in (v, u) or v in (u, 6 - u)]
    write_views(folder, {f"input_Cam{7 * v + u:03d}.png": (v, u) for v, u in places})


POSITIONS = "out_{v:02d}_{u:02d}_{y:.6f}_{x:.6f}_.png"


def stanford(row_mm: float, column_mm: float, pattern: str = POSITIONS, only: Any = ()) -> Write:
    """Return a writer of 3 x 4 views whose names state positions in millimetres, a little off the grid.

    only: index of the views that are there.
    """

    def write(folder: Path) -> None:
        jitter = np.random.default_rng(3).uniform(-0.02, 0.02, (3, 4, 2)) * (pattern[0] == "o")
        for v, u in np.indices((3, 4))[:, *only].reshape(2, -1).T.tolist():
            down, right = (v, u) + jitter[v, u]
            name = pattern.format(v=v, u=u, y=row_mm * down + 700, x=column_mm * right - 300)
            step = abs(column_mm) or 1.0
            write_views(folder, {name: (row_mm * down / step, column_mm * right / step)})

    return write


def middlebury(name: str, count: int, truths: tuple[int, int], width: int) -> Write:
    """Return a writer of a row of views, with maps of integers of two of them, unknown at the right."""

    def write(folder: Path) -> None:
        for n in range(count):
            Image.fromarray(np.tile(view(0, n), (1, 15, 1))[:, :width]).save(folder / name.format(n))
        for n, value in zip(truths, (120, 100)):
            stored = np.full((SIZE.height, width), value, np.uint8)
            stored[:, -30:] = 0
            Image.fromarray(stored).save(folder / f"disp{n}.png")

    return write


def middlebury_pair(folder: Path) -> None:
    write_views(folder, {f"im{n}.png": (0, n) for n in (0, 1)})
    write_map(folder / "disp0.pfm", 7.5)


def llff(folder: Path) -> None:
    """Write 2 x 3 views with poses in thirds of a metre, and smaller copies of some."""
    cameras = FieldCameras(GridShape(2, 3), SIZE, 40.0, (1.0, 4.0), 0.0)
    views = named("v{v}_u{u}.png", range(2), range(3))
    write_views(folder / "images", views)
    write_llff(folder, cameras, {name: ViewOffset(v - 1, u - 1) for name, (v, u) in views.items()})
    poses = np.load(folder / "poses_bounds.npy")
    np.save(folder / "poses_bounds.npy", poses * np.where(np.isin(np.arange(17), [3, 8, 13, 15, 16]), 3, 1))
    write_views(folder / "images_8", dict(list(views.items())[:2]))


def llff_free(folder: Path) -> None:
    """Write cameras that are half a unit apart, some nearer: they stand on no grid."""
    write_views(folder / "images", {f"IMG_{n}.png": (0, n) for n in range(3)})
    down, right, back = np.eye(3)[[1, 0, 2]] * [[1], [1], [-1]]
    places = [(-0.5, 0.0, 0.3), (0.0, 0.0, 0.0), (0.0, 0.5, 0.1)]
    poses = [np.column_stack([down, right, back, place, [*SIZE, 50]]).ravel() for place in places]
    np.save(folder / "poses_bounds.npy", np.array([[*pose, 5.0, 40.0] for pose in poses]))


def colmap(is_text: bool) -> Write:
    """Return a writer of 3 x 2 views whose rows stand 0.4 times as far apart, infinity at -1.5 px."""

    def write(folder: Path) -> None:
        views = named("pic {d}{v}.png", range(3), range(2))
        write_views(folder / "images", {name: (0.4 * v, u) for name, (v, u) in views.items()})
        offsets = {name: ViewOffset(0.4 * (v - 1), u - 1) for name, (v, u) in views.items()}
        cameras = FieldCameras(GridShape(3, 2), SIZE, 40.0, (1.0, 4.0), -1.5)
        write_colmap(folder, cameras, offsets, np.float32([[0, 1, 2]]), np.uint8([[1, 2, 3]]))
        for path in (folder / "sparse" / "0").glob("*.bin" if is_text else "*.txt"):
            path.unlink()

    return write


def transforms(folder: Path) -> None:
    """Write frames in a turned, larger world: angles and sizes by frame and by file, 3 x 4 matrices, no endings."""
    half = np.sqrt(0.5)
    turn = np.array([[half, 0, half], [0.5, half, -0.5], [-0.5, half, 0.5]])
    frames = []
    for name, (v, u) in write_named(folder, "{v}-{u}", 2, 2).items():
        matrix = 3 * turn @ np.column_stack([np.eye(3), [0.1 * u, -0.1 * v, 0]])
        matrix[:, :3] /= 3
        matrix[:, 3] += (5, -2, 1)
        frames.append({"file_path": f"./images/{name}", "transform_matrix": matrix.tolist()})
    frames[0] |= {"w": SIZE.width, "h": SIZE.height, "camera_angle_x": 0.8, "cy": 12.0}
    content = {"camera_angle_x": 0.8, "k1": 0, "camera_model": "OPENCV", "frames": frames}
    (folder / "transforms.json").write_text(f"\ufeff{json.dumps(content)}", "utf-8")


def without(write: Write, name: str) -> Write:
    """Return a writer of the same but for one picture."""
    return lambda folder: (write(folder), (folder / name).unlink())


def cut_end(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-300])


def write_named(folder: Path, pattern: str, rows: int, columns: int) -> dict[str, tuple[float, float]]:
    views = named(pattern, range(rows), range(columns))
    write_views(folder / "images", {f"{name}.png": at for name, at in views.items()})
    return views


def posed(pose: list[float]) -> Write:
    """Return a writer of one COLMAP camera, SIMPLE_PINHOLE, with this quaternion and translation."""

    def write(folder: Path) -> None:
        write_views(folder / "images", {"a b.png": (0, 0)})
        (folder / "sparse").mkdir()
        (folder / "sparse" / "cameras.txt").write_text(f"# c\n7 SIMPLE_PINHOLE {SIZE.width} {SIZE.height} 40 15 11\n")
        words = " ".join(map(str, pose))
        (folder / "sparse" / "images.txt").write_text(f"\ufeff1 {words} 7 a b.png\n\n", "utf-8")

    return write


def quilt(name: str, quilt: Quilt) -> Write:
    """Return a writer of a quilt; a view step is one tile."""

    def write(folder: Path) -> None:
        height, width = quilt.tile
        tiles = [np.array(Image.fromarray(view(0, k)).resize((width, height), 0)) for k in range(quilt.views)]
        Image.fromarray(lay_out(quilt, tiles)).save(folder / name)

    return write


def lenslets(columns: int, rows: int, is_ours: bool) -> Write:
    def write(folder: Path) -> None:
        pixels = np.zeros((rows * SIZE.height, columns * SIZE.width, 3), np.uint8)
        for v, u in np.ndindex(rows, columns):
            pixels[v::rows, u::columns] = view(v - rows // 2, u - columns // 2)
        write_image(folder / "a_ESLF (1).png", pixels, {LENSLET_KEY: f"{columns}x{rows}"} if is_ours else {})

    return write


def views(names: dict[str, tuple[float, float]], orientation: int = 1) -> Write:
    return lambda folder: write_views(folder, names, orientation)


TEN_BY_NINE = "num_cams_x = 10\nnum_cams_y = 9\n"
STATED = "num_cams_x = 4\nnum_cams_y = 3\n"
LAYOUTS: dict[str, Write] = {
    "hci": hci,
    "hci in part": with_parameters(views(named("input_Cam{v}{u}.png", range(0, 9, 4), range(1, 9, 2))), TEN_BY_NINE),
    "hci hole": views({f"input_Cam{k:03d}.png": (0, k) for k in range(9) if k != 4}),
    "grid": grid_with_maps, "star": star,
    "star hole": views({f"v{v}_u{u}.png": (v, u) for v, u in np.ndindex(5, 5) if 2 in (v, u) and (v, u) != (2, 1)}),
    "turned": views(named("v{v}_u{u}.jpg", range(2), range(3)), TURNED),
    "from the middle": views(named("image_{v:+d}_{u:+d}.png", range(-1, 2), range(-2, 3))),
    "columns first/views": views(named("{u:03d}_{v:03d}.ppm", range(1, 3), range(4))),
    "columns hole": views({f"{u:03d}_{v:03d}.ppm": (v, u) for v, u in np.ndindex(3, 4) if (v, u) != (0, 1)}),
    "stated": with_parameters(views(named("shot {k}.png", range(3), range(4), 5)), STATED),
    "too many": with_parameters(views(named("shot {k}.png", range(4), range(4))), STATED),
    "far": views({"v0_u0.png": (0, 0), "v9999_u9999.png": (1, 1)}),
    "by fours": views({f"shot {4 * k + 1}.png": divmod(k, 3) for k in range(9)}),
    "cut": lambda folder: cut_end(write_views(folder, named("v{v}_u{u}.png", range(2), range(2))) / "v0_u1.png"),
    "guessed": views(named("beach {k}.png", range(1), range(5))),
    "holiday": views({f"IMG_202307{day}_1{day}{k}.png": (0, k) for day in (11, 14) for k in range(3)}),
    "odd": lambda folder: (write_views(folder, named("v{v}_u{u}.png", range(2), range(2))),
                           Image.new("RGB", (6, 8)).save(folder / "v1_u1.png")),
    "stanford up": stanford(-30.0, 30.0), "stanford left": stanford(12.0, -30.0), "stanford even": stanford(0.0, 0.0),
    "stanford column": stanford(45.0, 20.0, only=(slice(None), 0)),
    "stanford thin": stanford(45.0, 20.0, only=(slice(None), slice(None, None, 2))),
    "rendered": stanford(5.0, 5.0, "Camera 1_{v:02d}_{u:02d}_{y:f}_{x:f}_30_36.png"),

    "middlebury 2003": middlebury("im{}.png", 9, (2, 6), 450),
    "middlebury 2001": middlebury("im{}.ppm", 9, (2, 6), 434),
    "middlebury 2005": middlebury("view{}.png", 7, (1, 5), 463), "middlebury pair": middlebury_pair, "llff": llff,
    "llff free": llff_free,
    "colmap": colmap(False), "colmap text": colmap(True), "llff hole": without(llff, "images/v0_u1.png"),
    "colmap hole": without(colmap(False), "images/pic 01.png"), "transforms": transforms,
    "nerfstudio": lambda folder: write_hard_field(folder / "field"),
    "quilt": quilt("a_qs4x2a3.png", Quilt(4, 2, ImageSize(49, 130), 3.0)),
    "quilt frame": quilt("a Quilt_3x2a0.75z1.2f0.5_0012.png", Quilt(3, 2, ImageSize(48, 72), 0.75)),
    "quilt few": quilt("a_qs8x6a1.png", Quilt(1, 1, ImageSize(5, 5), 1.0)),
    "lenslets": lenslets(3, 2, True), "lytro": lenslets(14, 14, False),
    "lenslets cut": lenslets(3, 2, False),
    "two": views({"imgLeft.png": (0, 0), "imgRight.png": (0, 2)}), "any two": views({"b.png": (0, 2), "a.png": (0, 0)}),
    "none": views({"view of a.png": (0, 0), "sea.png": (9, 9), "c.png": (5, 0)}),
}  # fmt: skip


@pytest.mark.parametrize("name", LAYOUTS)
def test_light_fields_are_opened_as_before(tmp_path, name, regenerate_golden) -> None:
    folder = tmp_path / "scene" / name
    folder.mkdir(parents=True)
    LAYOUTS[name](folder)
    inside = list(folder.iterdir())
    path = inside[0] if name.startswith(("quilt", "le", "ly", "nerf")) else folder
    path = folder / "field" if name == "nerfstudio" else path
    require_golden(field_facts(path), "fields", name, 2, regenerate_golden)


POSES: dict[str, Write] = {
    "transforms": transforms, "colmap": colmap(False), "colmap text": colmap(True), "llff": llff,
    "llff free": llff_free, "quarter turn": posed([np.sqrt(0.5), 0, 0, np.sqrt(0.5), 1, 2, 3]),
    "no length": posed([0, 0, 0, 0, 1, 2, 3]),
    "tilted": posed([2, 0.2, 0.4, 0.6, -1, 0.5, 2]), "none": views({"a.png": (0, 0)}),
}  # fmt: skip


@pytest.mark.parametrize("name", POSES)
def test_cameras_are_read_as_before(tmp_path, name, regenerate_golden) -> None:
    (tmp_path / "scene").mkdir()
    POSES[name](tmp_path / "scene")
    require_golden(camera_poses(tmp_path / "scene"), "cameras", name, 2, regenerate_golden)
