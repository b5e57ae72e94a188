import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from iibr_core.inpainting import diffusion
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.diffusion import LARGE_PX, align_in_gaps, large_gaps
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.runtime.work import Cancelled, stoppable, watched
from iibr_core.types import InputError, ViewOffset
from tests.iibr_core.scenes import smooth_texture

OFFSET = ViewOffset(0.0, 1.0)
STEPS = 2
BLOCKS = {"norm_num_groups": 4, "layers_per_block": 1}


@pytest.fixture(autouse=True)
def _few_steps(monkeypatch):
    monkeypatch.setattr(diffusion, "STEPS", STEPS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    import torch
    from diffusers import AutoencoderKL, DDIMScheduler, StableDiffusionInpaintPipeline, UNet2DConditionModel
    from transformers import CLIPTextConfig, CLIPTextModel, CLIPTokenizer

    torch.manual_seed(0)
    unet = UNet2DConditionModel(
        sample_size=16, in_channels=9, out_channels=4, block_out_channels=(8, 8), cross_attention_dim=8,
        attention_head_dim=4, down_block_types=("DownBlock2D", "CrossAttnDownBlock2D"),
        up_block_types=("CrossAttnUpBlock2D", "UpBlock2D"), **BLOCKS,
    )  # fmt: skip
    vae = AutoencoderKL(
        block_out_channels=(8, 8), down_block_types=("DownEncoderBlock2D",) * 2,
        up_block_types=("UpDecoderBlock2D",) * 2, sample_size=32, **BLOCKS,
    )  # fmt: skip
    text = CLIPTextConfig(
        hidden_size=8, intermediate_size=8, num_hidden_layers=1, num_attention_heads=2, vocab_size=2,
        max_position_embeddings=8, bos_token_id=0, eos_token_id=1,
    )  # fmt: skip
    tokenizer = CLIPTokenizer(vocab={"<|startoftext|>": 0, "<|endoftext|>": 1}, merges=[], model_max_length=8)
    pipeline = StableDiffusionInpaintPipeline(
        vae, CLIPTextModel(text), tokenizer, unet, DDIMScheduler(steps_offset=1, clip_sample=False), None, None,
        requires_safety_checker=False,
    )  # fmt: skip
    path = tmp_path_factory.mktemp("models") / "tiny"
    pipeline.save_pretrained(path)
    return path


def view_with_holes():
    """Return what an inpainter is given: a strip in front has left a large gap, and there is a crack beside it."""
    disparity, photo_disparity = np.zeros((40, 60), np.float32), np.zeros((40, 60), np.float32)
    disparity[:, 18:30], photo_disparity[:, 30:42] = 12.0, 12.0
    hole = np.zeros((40, 60), np.bool_)
    hole[:, 30:42] = hole[:, 50:52] = True
    colors = smooth_texture(40, 60)
    colors[hole], disparity[hole] = np.nan, np.nan
    return colors, disparity, hole, photo_disparity


def filled_by_background():
    colors, disparity, hole, photo_disparity = view_with_holes()
    fill_background(colors, disparity, hole, photo_disparity, OFFSET)
    return colors, disparity


def test_large_gaps_are_painted_and_all_else_is_background(folder):
    said = []
    inpaint = load_inpainter(f"diffusion:{folder}")
    colors, disparity, hole, photo_disparity = view_with_holes()
    with watched(lambda *progress: said.append(progress)):
        inpaint(colors, disparity, hole, photo_disparity, OFFSET)
    expected, continued = filled_by_background()
    gap = np.zeros_like(hole)
    gap[:, 30:42] = True
    np.testing.assert_array_equal(colors[~gap], expected[~gap])
    assert (colors[gap] != expected[gap]).any(axis=-1).mean() > 0.9
    assert ((colors >= 0) & (colors <= 1)).all()
    np.testing.assert_array_equal(disparity, continued)
    assert [done for done, *_ in said] == list(range(1, STEPS + 1))
    # The same each time.
    again, other, *rest = view_with_holes()
    inpaint(again, other, *rest, OFFSET)
    np.testing.assert_array_equal(again, colors)


def test_what_was_painted_gets_the_depth_that_the_estimator_sees_and_all_else_asks_no_model(folder):
    asked = []

    def estimated(painted):
        asked.append(painted)
        return estimate.astype(np.float32)

    inpaint = load_inpainter(f"diffusion:{folder}", estimated)
    colors, disparity, hole, photo_disparity = view_with_holes()
    # Twice the disparity and one more, and in the gap something half-way between wall and strip.
    estimate = 2 * np.where(hole, 6.0, disparity) + 1
    inpaint(colors, disparity, hole, photo_disparity, OFFSET)
    np.testing.assert_allclose(disparity[:, 30:42], 6.0, atol=1e-4)
    np.testing.assert_array_equal(disparity[:, 50:52], 0.0)
    colors, disparity, hole, photo_disparity = view_with_holes()
    hole[:, 30:42] = False
    colors[:, 30:42] = disparity[:, 30:42] = 0
    said = []
    with watched(lambda *progress: said.append(progress)):
        inpaint(colors, disparity, hole, photo_disparity, OFFSET)
    assert (len(asked), said) == (1, [])


def test_large_is_where_a_square_fits():
    hole = np.zeros((20, 40), np.bool_)
    hole[3:11, 5:13] = hole[2:15, 20 : 20 + LARGE_PX - 1] = True
    expected = np.zeros_like(hole)
    expected[3:11, 5:13] = True
    np.testing.assert_array_equal(large_gaps(hole), expected)
    assert not large_gaps(np.ones((3, 30), np.bool_)).any()


@pytest.mark.parametrize(
    ("slope", "start", "known", "expected"),
    [(3.0, 2.0, 40, 1.25), (3.0, -9.0, 40, 1.25), (-3.0, 2.0, 40, -8.0), (0.0, 2.0, 40, -8.0), (3.0, 2.0, 0, -8.0),
     (0.3, np.nan, 40, -8.0)],
    ids=["fits", "whatever its zero", "would swap near and far", "flat", "nothing known", "not finite"],
)  # fmt: skip
def test_estimated_disparity_is_fitted_to_what_is_known_around(slope, start, known, expected):
    """The gap holds 1.25, then values beyond all that is known around it, which are cut off."""
    disparity = np.tile(np.linspace(0.0, 2.0, 60, dtype=np.float32), (40, 1))
    hole = np.ones((40, 60), np.bool_)
    hole[:, :25] = hole[:, 45:] = False
    hole[known:] = True
    large = np.zeros_like(hole)
    large[:20, 28:42] = True
    given = np.where(large, np.float32(1.25), disparity)
    given[10:12, 30] = 50.0, -50.0
    values = np.where(hole, np.float32(-8.0), disparity)
    with np.errstate(invalid="ignore"):
        align_in_gaps((slope * given + start).astype(np.float32), values, hole, large)
    assert values[5, 35] == pytest.approx(expected, abs=1e-3)
    reached = disparity[0, [16, 53]] if expected > 0 else (-8.0, -8.0)
    assert (values[11, 30], values[10, 30]) == pytest.approx(tuple(reached), abs=1e-3)
    assert (values[~large] == np.where(hole, np.float32(-8.0), disparity)[~large]).all()


def test_painting_stops_when_the_job_is_cancelled(folder):
    done = []
    inpaint = load_inpainter(f"diffusion:{folder}")
    with watched(lambda *progress: done.append(progress)), stoppable(lambda: bool(done)), pytest.raises(Cancelled):
        inpaint(*view_with_holes(), OFFSET)
    assert len(done) == 1


def test_errors_are_one_line_that_names_the_folder(folder, tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        load_inpainter(f"diffusion:{tmp_path / 'none'}")
    for typed in ("diffusion", "diffusion:", "background:folder", "magic"):
        with pytest.raises(InputError, match=rf"{typed}: .*background or diffusion:FOLDER"):
            load_inpainter(typed)
    (tmp_path / "empty").mkdir()
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    index = json.loads((other / "model_index.json").read_text())
    (other / "model_index.json").write_text(json.dumps({**index, "_class_name": "DDPMPipeline"}))
    damaged = tmp_path / "damaged"
    shutil.copytree(folder, damaged)
    (damaged / "unet" / "diffusion_pytorch_model.safetensors").write_bytes(b"nonsense")
    for path in (tmp_path / "empty", other, damaged):
        with pytest.raises(InputError, match="cannot be loaded as an inpainting pipeline") as caught:
            load_inpainter(f"diffusion:{path}")
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)
