import math
from pathlib import Path

import numpy as np
import pytest
import torch
from skimage.metrics import peak_signal_noise_ratio as skimage_psnr
from skimage.metrics import structural_similarity

from iibr_core.color import encoded_from_stored
from iibr_core.evaluation.lpips import Lpips
from iibr_core.evaluation.metrics import MAX_DB, bounded_psnr, flip, psnr, ssim
from iibr_core.evaluation.refocus import FocalStack, Focus, foci_of
from iibr_core.types import InputError, ViewOffset
from tests.iibr_core.known_scenes import WALL, disparity_of_square, offsets_of
from tests.iibr_core.lens_scenes import GRID, NAMES, lens_scene
from tests.iibr_core.scenes import generate, literal_plan, smooth_texture


def pair(seed: int = 0, size: tuple[int, int] = (24, 30)) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    truth = smooth_texture(*size, seed)
    return np.clip(truth + rng.normal(0, 0.05, truth.shape), 0, 1).astype(np.float32), truth


def test_psnr_of_masks_and_of_what_is_not_known() -> None:
    truth = np.full((4, 5, 3), 0.5, np.float32)
    worse, mask = truth.copy(), np.zeros((4, 5), bool)
    assert math.isnan(psnr(truth, truth, mask))
    worse[0, 0], mask[0, 0] = 1.0, True
    assert psnr(worse, truth, mask) == pytest.approx(10 * math.log10(1 / 0.25), abs=1e-4)
    assert psnr(worse, truth, ~mask) == math.inf
    assert math.isnan(psnr(np.full_like(truth, np.nan), truth))
    assert bounded_psnr(worse, truth) == psnr(worse, truth)
    assert bounded_psnr(truth, truth) == bounded_psnr(truth + np.float32(1e-7), truth) == MAX_DB == 100
    assert math.isnan(bounded_psnr(truth, truth, np.zeros(truth.shape[:2], bool)))


def test_metrics_are_those_of_scikit_image() -> None:
    image, truth = pair(3, (40, 52))
    assert psnr(image, truth) == pytest.approx(skimage_psnr(truth.astype(float), image.astype(float), data_range=1))
    settings = {"gaussian_weights": True, "use_sample_covariance": False, "data_range": 1, "channel_axis": 2}
    assert ssim(image, truth) == pytest.approx(structural_similarity(truth, image, **settings))
    assert math.isnan(ssim(image[:5], truth[:5]))


def test_flip_of_known_pairs() -> None:
    black, white = np.zeros((40, 40, 3), np.float32), np.ones((40, 40, 3), np.float32)
    assert flip(black, white) == pytest.approx(0.97, abs=0.02)
    _, truth = pair()
    assert flip(truth, truth) == 0
    errors = [flip(np.clip(truth + np.float32(step), 0, 1), truth) for step in (0.01, 0.05, 0.2)]
    assert errors == sorted(errors)
    assert errors[0] > 0


@pytest.fixture(scope="module")
def networks(tmp_path_factory) -> Path:
    """AlexNet and LPIPS's weights as their authors save them, random ones."""
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("lpips")
    channels, sizes = (3, 64, 192, 384, 256, 256), (11, 5, 3, 3, 3)
    stored = {}
    for k, (number, size) in enumerate(zip((0, 3, 6, 8, 10), sizes)):
        stored[f"features.{number}.weight"] = torch.randn(channels[k + 1], channels[k], size, size) / size
        stored[f"features.{number}.bias"] = torch.randn(channels[k + 1])
    torch.save(stored, folder / "alexnet-owt-7be5be79.pth")
    shares = {f"lin{k}.model.1.weight": torch.rand(1, channels[k + 1], 1, 1) for k in range(5)}
    torch.save(shares, folder / "alex.pth")
    return folder


def slow_lpips(folder: Path, image: np.ndarray, truth: np.ndarray) -> float:
    """Return LPIPS written out for AlexNet's first layer and no other."""
    stored = torch.load(folder / "alexnet-owt-7be5be79.pth", weights_only=True)
    share = torch.load(folder / "alex.pth", weights_only=True)["lin0.model.1.weight"]
    shift, scale = torch.tensor([-0.030, -0.088, -0.188]), torch.tensor([0.458, 0.448, 0.450])
    seen = []
    for picture in (image, truth):
        x = ((torch.from_numpy(picture) * 2 - 1 - shift) / scale).permute(2, 0, 1)[None]
        weight, bias = stored["features.0.weight"], stored["features.0.bias"]
        x = torch.relu(torch.nn.functional.conv2d(x, weight, bias, stride=4, padding=2))
        seen.append(x / x.norm(dim=1, keepdim=True))
    return float(((seen[0] - seen[1]).nan_to_num() ** 2 * share.view(1, -1, 1, 1)).sum(dim=1).mean())


def test_lpips_is_its_slow_twin(networks, tmp_path) -> None:
    shares = torch.load(networks / "alex.pth", weights_only=True)
    kept = {name: value if name.startswith("lin0") else torch.zeros_like(value) for name, value in shares.items()}
    torch.save(kept, tmp_path / "alex.pth")
    (tmp_path / "alexnet-owt-7be5be79.pth").symlink_to(networks / "alexnet-owt-7be5be79.pth")
    image, truth = pair(size=(70, 80))
    assert Lpips(tmp_path)(truth, truth) == 0
    assert math.isnan(Lpips(tmp_path)(truth[:30], truth[:30]))
    assert Lpips(tmp_path)(image, truth) == pytest.approx(slow_lpips(tmp_path, image, truth), rel=1e-4)


@pytest.mark.parametrize("name", ["alexnet-owt-7be5be79.pth", "alex.pth"])
def test_bad_networks_are_one_clear_line(networks, tmp_path, name) -> None:
    for path in networks.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    shapeless = {key: value[:0] for key, value in torch.load(tmp_path / name, weights_only=True).items()}
    for damage in (lambda path: torch.save(shapeless, path), lambda path: path.write_text("no weights"), Path.unlink):
        damage(tmp_path / name)
        with pytest.raises(InputError, match=rf"^[^\n]*{name}[^\n]*$"):
            Lpips(tmp_path)


MADE_DB = {"shelf": 42.0, "fence": 38.5}
"""Lowest PSNR of a refocused field against the lens; the photo as it is has 30.4 and 24.3."""


def refocused(views: dict[ViewOffset, np.ndarray], focus: Focus) -> np.ndarray:
    stack = FocalStack([focus], views[ViewOffset(0.0, 0.0)])
    for offset, view in views.items():
        if offset != (0, 0):
            stack.add(offset, view)
    (picture,) = stack.pictures().values()
    return picture


def test_foci_lie_where_the_scene_does() -> None:
    foci = foci_of(list(offsets_of(5, 5).values())[1:], disparity_of_square())
    assert foci == [Focus("near", 2.0, 2.0), Focus("middle", WALL, 2.0), Focus("far", WALL, 2.0)]


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 9), (9, 1), (2, 2), (2, 9)])
def test_few_views_and_one_pixel_are_no_lens(rows, columns) -> None:
    offsets = [at for at in offsets_of(rows, columns).values() if at != (0, 0)]
    assert foci_of(offsets, disparity_of_square()) == []
    assert foci_of([ViewOffset(t, s) for t in (-4.0, 4.0) for s in (-4.0, 4.0)], disparity_of_square()) == []
    assert foci_of([at for at in offsets_of(3, 3).values() if at != (0, 0)], np.zeros((1, 1), np.float32)) == []


@pytest.mark.parametrize("name", NAMES)
def test_a_made_field_refocuses_as_the_lens_does(name) -> None:
    scene = lens_scene(name)
    focus = Focus("lens", scene.lens.focus_disparity, scene.lens.radius_views)
    margin = focus.margin_px
    lens = scene.lens.picture[margin:-margin, margin:-margin]
    true = {GRID.offset(*index): view for index, view in scene.views.items()}
    updates = generate(scene.photo, scene.disparity, literal_plan(scene.photo, scene.disparity, *GRID))
    made = {GRID.offset(update.row, update.column): encoded_from_stored(update.colors) for update in updates}
    assert MADE_DB[name] < psnr(refocused(made, focus), lens) < psnr(refocused(true, focus), lens)
    turned = Focus("lens", -scene.lens.focus_disparity, scene.lens.radius_views)
    assert psnr(refocused(true, turned), lens) < MADE_DB[name] - 5
