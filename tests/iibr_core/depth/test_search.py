"""Which depth a photo gets, what is said about it, and what happens where a source fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice, DepthStart
from iibr_core.depth.estimators import estimate_cache
from iibr_core.depth.estimators.catalog import USUAL_MODEL, known_model
from iibr_core.depth.estimators.download import VERIFIED
from iibr_core.depth.search import PhotoWithDepth, open_with_depth, sketch_depth
from iibr_core.formats.images.photo import read_photo
from iibr_core.runtime.work import Cancelled, stoppable, watched
from iibr_core.types import ImageSize, InputError
from tests.iibr_core import embedded_files as files
from tests.iibr_core.depth.onnx_graphs import published

SIZE = ImageSize(48, 72)
DEPTH = np.full(SIZE, 200, np.uint8)
DEPTH[12:36, 24:48] = 20  # dark is near
NEAR = np.s_[12:36, 24:48]


@pytest.fixture(autouse=True)
def nothing_at_hand(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No model and no cache of the user's."""
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "cache")


def photo_file(folder: Path, depth: np.ndarray | bytes | None = DEPTH, orientation: int = 1, **options: object) -> Path:
    """A photo of a near square before a wall; with GDepth unless depth is None."""
    pixels = np.full((*SIZE, 3), 60, np.uint8)
    pixels[NEAR] = (220, 180, 90)
    data = files.picture(pixels, orientation=orientation)
    if depth is not None:
        stored = files.picture(depth, "PNG") if isinstance(depth, np.ndarray) else depth
        data = files.with_segments(data, files.gdepth_segments(stored, **options))  # type: ignore[arg-type]
    (folder / "scene.jpg").write_bytes(data)
    return folder / "scene.jpg"


def start_from(start: DepthStart, **others: object) -> DepthChoice:
    return DepthChoice(start, refine=False, **others)  # type: ignore[arg-type]


def is_nearer_inside(found: PhotoWithDepth) -> bool:
    values = found.disparity.values
    assert values.shape == found.photo.size
    assert values.dtype == np.float32
    assert np.isfinite(values).all()
    return bool(values[NEAR].min() > values[:6].max())


def test_the_order_file_embedded_rough(tmp_path: Path) -> None:
    path = photo_file(tmp_path)
    sidecar = np.zeros(SIZE, np.float32)
    sidecar[NEAR] = 3
    np.save(tmp_path / "scene_disparity.npy", sidecar)
    found = open_with_depth(path, start_from("auto"))
    assert (found.origin.kind, found.origin.words) == ("file", "scene_disparity.npy")
    np.testing.assert_array_equal(found.disparity.values, sidecar)
    found = open_with_depth(path, start_from("embedded"))
    assert (found.origin.kind, found.origin.line) == ("embedded", "Depth: the photo itself (Google GDepth).")
    assert is_nearer_inside(found)
    found = open_with_depth(path, start_from("rough"))
    assert (found.origin.kind, found.origin.failures) == ("rough", ())
    assert found.disparity.viewing_share < 1
    assert "--disparity" in found.origin.advice
    assert "--depth-model" in found.origin.advice
    assert any("rough" in note for note in found.disparity.notes)
    found = open_with_depth(path, start_from("flat"))
    assert found.origin.kind == "flat"
    assert not found.disparity.values.any()


def test_a_sketch_finds_what_is_quick_in_the_same_order(tmp_path: Path) -> None:
    path = photo_file(tmp_path)
    photo = read_photo(path)
    assert sketch_depth(path, photo, start_from("auto")).origin.kind == "embedded"
    assert is_nearer_inside(sketch_depth(path, photo, start_from("embedded")))
    assert sketch_depth(path, photo, start_from("rough")).origin.kind == "rough"
    assert sketch_depth(path, photo, start_from("model")).origin.kind == "rough"
    assert sketch_depth(path, photo, start_from("flat")).origin.kind == "flat"
    sidecar = tmp_path / "scene_disparity.npy"
    np.save(sidecar, np.zeros(SIZE, np.float32))
    assert sketch_depth(path, photo, start_from("auto")).origin.kind == "file"
    assert sketch_depth(path, photo, start_from("auto", file=str(sidecar))).origin.kind == "file"
    sidecar.write_bytes(b"no map")
    assert sketch_depth(path, photo, start_from("auto")).origin.kind == "embedded"
    with pytest.raises(InputError):
        sketch_depth(path, photo, start_from("auto", file=str(sidecar)))


def test_a_bad_map_beside_the_photo_is_followed_by_the_next(tmp_path: Path) -> None:
    path = photo_file(tmp_path)
    np.save(tmp_path / "scene_disparity.npy", np.full(SIZE, np.nan))
    found = open_with_depth(path)
    assert found.origin.kind == "embedded"
    (failure,) = found.origin.failures
    assert "scene_disparity.npy" in failure
    assert failure in found.disparity.notes


def test_a_bad_map_that_is_named_is_an_error(tmp_path: Path) -> None:
    path = photo_file(tmp_path)
    np.save(tmp_path / "bad.npy", np.full(SIZE, np.nan))
    for name in ("bad.npy", "gone.npy"):
        with pytest.raises(InputError, match=name):
            open_with_depth(path, DepthChoice(file=str(tmp_path / name)))


@pytest.mark.parametrize(
    ("depth", "options"),
    [
        (b"no picture", {}),
        (files.picture(DEPTH, "PNG")[:-30], {}),
        (DEPTH[:, :20], {}),  # high, where the photo is wide
    ],
)
def test_damaged_depth_is_told_and_followed_by_the_next(
    depth: np.ndarray | bytes, options: dict[str, object], tmp_path: Path
) -> None:
    found = open_with_depth(photo_file(tmp_path, depth, **options))
    assert found.origin.kind == "rough"
    assert found.origin.failures[0].startswith("The photo's own depth was not used: ")
    assert "\n" not in found.origin.failures[0]
    assert found.origin.failures[0] in found.disparity.notes


def damaged_model(folder: Path, files_there: tuple[str, ...]) -> Path:
    folder.mkdir(parents=True)
    for name in files_there:
        (folder / name).write_text('{"model_type": "depth_anything"}')
    return folder


@pytest.mark.parametrize("files_there", [(), ("model.safetensors",), ("config.json", "pytorch_model.bin")])
def test_a_model_that_was_asked_for_must_be_good(files_there: tuple[str, ...], tmp_path: Path) -> None:
    model = damaged_model(tmp_path / "model", files_there)
    with pytest.raises(InputError, match="model"):
        open_with_depth(photo_file(tmp_path, None), DepthChoice(model=str(model)))


def test_a_model_is_asked_for_where_there_is_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--depth model: none is on this machine"):
        open_with_depth(photo_file(tmp_path), start_from("model"))


def test_a_damaged_usual_model_is_told_and_followed_by_the_next(tmp_path: Path) -> None:
    usual = known_model(USUAL_MODEL)
    snapshot = tmp_path / "hub" / f"models--{usual.repository.replace('/', '--')}" / "snapshots" / usual.commit
    published(snapshot)
    (snapshot / VERIFIED).write_text("{}")
    (snapshot / "onnx" / "model.onnx").write_bytes(b"no model")
    found = open_with_depth(photo_file(tmp_path, None))
    assert found.origin.kind == "rough"
    assert found.origin.failures[0].startswith("The depth model was not used: ")


def test_a_model_is_used_and_named(tmp_path: Path) -> None:
    from tests.iibr_core.depth.test_transformers_models import depth_anything

    folder = depth_anything(tmp_path / "tiny").folder
    told: list[str] = []
    choice = DepthChoice(model=str(folder))

    def report(done: float, total: float, doing: str) -> None:
        assert 0 <= done <= total
        told.append(doing)

    with watched(report):
        found = open_with_depth(photo_file(tmp_path, None), choice)
    assert (found.origin.kind, found.origin.words) == ("model", "estimated by the model in tiny")
    assert found.origin.failures == ()
    assert any("estimating depth" in doing for doing in told)
    assert open_with_depth(photo_file(tmp_path), choice).origin.kind == "embedded"  # its own depth comes first
    assert open_with_depth(photo_file(tmp_path), start_from("model", model=str(folder))).origin.kind == "model"


@pytest.mark.parametrize(
    ("orientation", "is_turned_already"), [(n, False) for n in range(1, 9)] + [(n, True) for n in range(5, 9)]
)
def test_depth_is_turned_with_the_photo(orientation: int, is_turned_already: bool, tmp_path: Path) -> None:
    """Some writers turn the map already; that shows in its shape only where the sides are swapped."""
    from iibr_core.formats.images.picture import upright

    depth = np.full(SIZE, 200, np.uint8)
    depth[:10, :14] = 20
    stored = upright(depth, orientation) if is_turned_already else depth
    found = open_with_depth(photo_file(tmp_path, stored, orientation), start_from("auto"))
    values = found.disparity.values
    expected = upright(depth, orientation) < 100
    assert values.shape == found.photo.size == expected.shape
    assert values[expected].min() > values[~expected].max()


@pytest.mark.parametrize("scale", [0.5, 2, 3])
def test_depth_of_another_size_is_resampled_without_values_in_between(scale: float, tmp_path: Path) -> None:
    places = [(np.arange(int(side * scale)) / scale).astype(int) for side in SIZE]
    found = open_with_depth(photo_file(tmp_path, DEPTH[np.ix_(*places)]), start_from("auto"))
    assert is_nearer_inside(found)
    assert len(np.unique(found.disparity.values)) == 2


def test_unknown_depth_is_filled_from_behind(tmp_path: Path) -> None:
    sure = np.full(SIZE, 255, np.uint8)
    sure[2:9, 2:9] = 0
    found = open_with_depth(photo_file(tmp_path, confidence=files.picture(sure, "PNG")), start_from("auto"))
    assert len(np.unique(found.disparity.values)) == 2
    assert (found.disparity.values[:12, :20] == found.disparity.values[-1, -1]).all()


def test_the_sharp_picture_is_shown(tmp_path: Path) -> None:
    sharp = np.full((2 * SIZE[0], 2 * SIZE[1], 3), 200, np.uint8)
    found = open_with_depth(photo_file(tmp_path, sharp=files.picture(sharp)))
    assert found.photo.size == sharp.shape[:2]
    assert found.photo.pixels.mean() == pytest.approx(200 / 255, abs=0.01)
    assert found.photo.focal_px == pytest.approx(2 * open_with_depth(photo_file(tmp_path)).photo.focal_px)
    assert any("sharp" in note for note in found.photo.notes)
    assert open_with_depth(photo_file(tmp_path, sharp=files.picture(sharp)), max_pixels=500).photo.pixels.size <= 1500


@pytest.mark.parametrize("sharp", [b"no picture", files.grey_photo((50, 50)), files.grey_photo(SIZE)[:-200]])
def test_a_sharp_picture_that_is_none_leaves_the_photo(sharp: bytes, tmp_path: Path) -> None:
    found = open_with_depth(photo_file(tmp_path, sharp=sharp))
    assert found.photo.size == SIZE
    assert found.origin.kind == "embedded"
    assert any("blurred" in note for note in found.photo.notes)


def test_metric_depth_gives_the_same_order(tmp_path: Path) -> None:
    assert is_nearer_inside(open_with_depth(photo_file(tmp_path, units="m"), start_from("auto")))


def test_a_heic_portrait(tmp_path: Path) -> None:
    pixels, depth = np.full((96, 144, 3), 60, np.uint8), np.zeros((48, 72), np.uint8)
    depth[NEAR] = 250  # bright is near
    (tmp_path / "a.heic").write_bytes(files.heic(pixels, depth))
    found = open_with_depth(tmp_path / "a.heic", start_from("auto"))
    assert found.origin.words == "the photo itself (Apple portrait)"
    assert found.disparity.values[30:66, 54:90].min() > found.disparity.values[:10].max()
    (tmp_path / "b.heic").write_bytes(files.heic(pixels))
    assert open_with_depth(tmp_path / "b.heic").origin.kind == "rough"


def test_it_stops_before_what_takes_long(tmp_path: Path) -> None:
    with pytest.raises(Cancelled), stoppable(lambda: True):
        open_with_depth(photo_file(tmp_path, None))


def test_a_bad_photo_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8\xff nothing")
    with pytest.raises(InputError, match=r"a\.jpg"):
        open_with_depth(tmp_path / "a.jpg")


def test_other_maps_of_the_photo_are_named_once(tmp_path: Path) -> None:
    """Whatever they say: here the contrary."""
    path = photo_file(tmp_path)
    near_wall = np.where(np.load(_square(tmp_path)) > 0, 0, 3).astype(np.float32)
    np.save(tmp_path / "scene_disparity.npy", near_wall)
    np.save(tmp_path / "scene_depth.npy", np.full(SIZE, 2.0, np.float32))
    for choice, used, unused in (
        (DepthChoice(refine=False), "scene_disparity.npy", "scene_depth.npy"),
        (DepthChoice(file=str(tmp_path / "square.npy"), refine=False), "square.npy", "scene_disparity.npy"),
    ):
        found = open_with_depth(path, choice)
        (note,) = [note for note in found.disparity.notes if "not used" in note]
        assert used in note.split(";")[0]
        assert unused in note
        assert "Google GDepth" in note
        assert np.isfinite(found.disparity.values).all()
        assert is_nearer_inside(found) == (used == "square.npy")


def _square(folder: Path) -> Path:
    values = np.zeros(SIZE, np.float32)
    values[NEAR] = 3
    np.save(folder / "square.npy", values)
    return folder / "square.npy"


def test_what_is_unknown_of_the_photos_own_depth_is_said(tmp_path: Path) -> None:
    sure = np.zeros(SIZE, np.uint8)
    sure[::5, ::5] = 255
    found = open_with_depth(photo_file(tmp_path, confidence=files.picture(sure, "PNG")), start_from("auto"))
    assert np.isfinite(found.disparity.values).all()
    assert found.disparity.values[20:28, 32:40].min() > found.disparity.values[:6].max()
    (note,) = found.disparity.notes
    assert "Only 4.3 % of its depth is known" in note
    assert "filled" in note
