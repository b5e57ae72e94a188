from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.choice import DepthChoice, DepthStart
from iibr_core.depth.search import PhotoWithDepth, open_with_depth
from iibr_core.depth.sidecar import find_sidecars, map_to_read
from iibr_core.remedies import Remedy, remedy_of
from iibr_core.runtime.work import watched
from iibr_core.types import ImageSize, InputError
from tests.iibr_core import embedded_files as files
from tests.iibr_core.depth.onnx_graphs import of_channels

SIZE = ImageSize(48, 72)
DEPTH = np.full(SIZE, 200, np.uint8)
DEPTH[12:36, 24:48] = 20  # dark is near
NEAR = np.s_[12:36, 24:48]


def photo_file(folder: Path, depth: np.ndarray | bytes | None = DEPTH, orientation: int = 1, **options: object) -> Path:
    pixels = np.full((*SIZE, 3), 60, np.uint8)
    pixels[NEAR] = (220, 180, 90)
    data = files.picture(pixels, orientation=orientation)
    if depth is not None:
        stored = files.picture(depth, "PNG") if isinstance(depth, np.ndarray) else depth
        data = files.with_segments(data, files.gdepth_segments(stored, **options))
    (folder / "scene.jpg").write_bytes(data)
    return folder / "scene.jpg"


def start_from(start: DepthStart, **others: object) -> DepthChoice:
    return DepthChoice(start, refine=False, **others)


def is_nearer_inside(found: PhotoWithDepth) -> bool:
    values = found.disparity.values
    assert values.shape == found.photo.size
    assert values.dtype == np.float32
    assert np.isfinite(values).all()
    return bool(values[NEAR].min() > values[:6].max())


def test_the_order_file_embedded_rough(tmp_path) -> None:
    path = photo_file(tmp_path)
    sidecar = np.zeros(SIZE, np.float32)
    sidecar[NEAR] = 3
    np.save(tmp_path / "scene_disparity.npy", sidecar)
    found = open_with_depth(path, start_from("auto"))
    assert (found.origin.kind, found.origin.words) == ("file", "scene_disparity.npy")
    np.testing.assert_array_equal(found.disparity.values, sidecar)
    (tmp_path / "scene_depth.png").write_bytes(files.picture(DEPTH, "PNG"))
    both = open_with_depth(path, start_from("auto"))
    assert both.disparity.notes[0] == "Only scene_disparity.npy counts; not used: scene_depth.png."
    (tmp_path / "depth").mkdir()
    (tmp_path / "depth" / "scene.png").write_bytes(files.picture(DEPTH, "PNG"))
    assert [file.name for file in find_sidecars(path)] == ["scene_disparity.npy", "scene_depth.png", "scene.png"]
    (tmp_path / "scene_depth.png").unlink()
    (tmp_path / "depth" / "scene.png").unlink()
    assert map_to_read(path, start_from("auto")) == tmp_path / "scene_disparity.npy"
    assert map_to_read(path, start_from("rough")) is None
    assert map_to_read(path, start_from("rough", file="a.png")) == Path("a.png")
    found = open_with_depth(path, start_from("embedded"))
    assert (found.origin.kind, found.origin.line) == ("embedded", "Depth: the photo itself (Google GDepth).")
    assert is_nearer_inside(found)
    found = open_with_depth(path, start_from("rough"))
    assert (found.origin.kind, found.origin.failures) == ("rough", ())
    found = open_with_depth(path, start_from("flat"))
    assert found.origin.kind == "flat"
    assert not found.disparity.values.any()
    (tmp_path / "scene_disparity.npy").unlink()
    for kind in ("photometric", "geometric"):
        (tmp_path / f"scene.jpg.{kind}.bin").write_bytes(b"72&48&1&" + DEPTH.astype("<f4").tobytes())
    assert open_with_depth(path, start_from("auto")).origin.words == "scene.jpg.geometric.bin", "COLMAP's better one"


MAPS = {
    "A.JPG": ["A_depth.PNG", "A_Depth.TIF", "A-depth.png", "a_depthmap.png", "A.depth.png", "A depth (1).bmp",
              "A_disp.png", "depth_A.png", "A_depth_16bit.png", "depth/A.png", "Depth Maps/A_depth.png"],
    "A_rgb.png": ["A_depth.png", "A_depthmap.jpg"],
    "f-1.color.jpg": ["f-1.depth.png"],
    "rgb_001.png": ["depth_001.png", "depth001.png"],
    "rgb.png": ["depth.png"],
    "rgb/000.png": ["depth/000.png", "depth/depth_000.png", "disparity/000.png"],
    "color/frame-01.color.jpg": ["depth/frame-01.depth.png"],
}  # fmt: skip
"""Names of maps by the names of their photos."""


@pytest.mark.parametrize(("photo", "name"), [(photo, name) for photo, names in MAPS.items() for name in names])
def test_a_map_beside_the_photo_is_used_whatever_its_usual_name(tmp_path, photo, name) -> None:
    values = np.full(SIZE, 60, np.uint8)
    values[NEAR] = 200
    for path, picture in ((tmp_path / photo, np.repeat(values[..., None], 3, 2)), (tmp_path / name, values)):
        path.parent.mkdir(exist_ok=True)
        Image.fromarray(picture).save(path)
    (tmp_path / Path(photo).parent / "other_depth.png").write_bytes(b"-")
    found = open_with_depth(tmp_path / photo, start_from("auto"))
    assert found.origin.file is not None
    assert Path(found.origin.file).samefile(tmp_path / name)
    assert is_nearer_inside(found)


def test_maps_that_are_not_used_are_named(tmp_path) -> None:
    path = photo_file(tmp_path, None)
    for name in ("scene_depth_old2.png", "SCENE_depth.mat", "scene.npz", "scene_2.png", "else_depth2.png"):
        (tmp_path / name).write_bytes(b"-")
    (note,) = (note for note in open_with_depth(path).disparity.notes if note.startswith("Not used"))
    assert "SCENE_depth.mat, scene.npz, scene_depth_old2.png." in note
    assert "scene_depth," in note
    np.save(tmp_path / "scene-disparity.npy", np.zeros(SIZE))  # the name of an export of this program
    assert open_with_depth(path).origin.kind == "rough"
    (tmp_path / "scene_depth.png").write_bytes(files.picture(DEPTH[:40, :40], "PNG"))
    (failure,) = open_with_depth(path).origin.failures
    assert remedy_of(failure) is Remedy.STRETCH


@pytest.mark.parametrize("depth", [b"no picture", files.picture(DEPTH, "PNG")[:-30], DEPTH[:, :20]])
def test_damaged_depth_is_followed_by_the_next_with_a_note(depth, tmp_path) -> None:
    found = open_with_depth(photo_file(tmp_path, depth))
    assert found.origin.kind == "rough"
    (failure,) = found.origin.failures
    assert failure.startswith("The photo's own depth was not used: ")
    assert "\n" not in failure
    assert failure in found.disparity.notes


@pytest.mark.parametrize(
    ("choice", "message"),
    [(start_from("model"), "v2-small is not on this machine"), (DepthChoice(model="{dir}/empty"), "empty"),
     (DepthChoice(file="{dir}/bad.npy"), r"bad\.npy"), (DepthChoice(file="{dir}/gone.npy"), r"gone\.npy")],
)  # fmt: skip
def test_depth_that_was_asked_for_must_be_there_and_good(choice, message, tmp_path) -> None:
    (tmp_path / "empty").mkdir()
    np.save(tmp_path / "bad.npy", np.full(SIZE, np.nan))
    file, model = (name and name.format(dir=tmp_path) for name in (choice.file, choice.model))
    with pytest.raises(InputError, match=message):
        open_with_depth(photo_file(tmp_path, None), replace(choice, file=file, model=model))


def test_a_model_is_used_and_named(tmp_path) -> None:
    choice, reports = DepthChoice(model=str(of_channels(tmp_path / "red.onnx"))), []
    with watched(lambda *report: reports.append(report)):
        found = open_with_depth(photo_file(tmp_path, None), choice)
    assert all(0 <= done <= total for done, total, _ in reports)
    assert any("estimating depth" in doing for *_, doing in reports)
    assert (found.origin.kind, found.origin.words) == ("model", "estimated by the model red.onnx")
    assert found.origin.failures == ()
    assert open_with_depth(photo_file(tmp_path), choice).origin.kind == "embedded"  # its own depth comes first
    assert open_with_depth(photo_file(tmp_path), replace(choice, start="model")).origin.kind == "model"


def test_the_sharp_picture_is_shown(tmp_path) -> None:
    sharp = np.full((2 * SIZE[0], 2 * SIZE[1], 3), 200, np.uint8)
    found = open_with_depth(photo_file(tmp_path, sharp=files.picture(sharp)))
    assert found.photo.size == sharp.shape[:2]
    assert found.photo.pixels.mean() == pytest.approx(200 / 255, abs=0.01)
    assert found.photo.focal_px == pytest.approx(2 * open_with_depth(photo_file(tmp_path)).photo.focal_px)
    assert any("sharp" in note for note in found.photo.notes)
    assert open_with_depth(photo_file(tmp_path, sharp=files.picture(sharp)), max_pixels=500).photo.pixels.size <= 1500
    turned = open_with_depth(photo_file(tmp_path, orientation=6, sharp=files.picture(sharp)))
    assert turned.photo.size == sharp.shape[1::-1], "turned like the photo, as it states nothing itself"
    for bad in (b"no picture", files.grey_photo((50, 50)), files.grey_photo(SIZE)[:300]):
        found = open_with_depth(photo_file(tmp_path, sharp=bad))
        assert (found.photo.size, found.origin.kind) == (SIZE, "embedded")
        assert any("blurred" in note for note in found.photo.notes), "a bad one leaves the photo"
