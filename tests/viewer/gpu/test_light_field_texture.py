"""The texture arrays: what is stored, and plain words where they do not fit."""

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb
from iibr_core.formats.images.photo import size_within
from iibr_core.types import GridShape, ImageSize, InputError
from viewer.gpu.light_field_texture import LightFieldTexture, check_fits

GRID = GridShape(2, 3)


def test_stores_root_of_linear_light_in_the_views_own_layer(gl):
    field = LightFieldTexture(gl.ctx, GRID, 8, 4, hdr=False, with_disparity=True)
    colors = np.arange(4 * 8 * 3, dtype=np.uint8).reshape(4, 8, 3) * 2
    disparity = np.linspace(-2, 3, 32, dtype=np.float32).reshape(4, 8)
    field.upload(1, 2, colors, disparity)
    texels = np.frombuffer(field.colors.read(), np.uint8).reshape(6, 4, 8, 4)
    root = np.sqrt(linear_from_srgb(colors / 255)) * 255
    assert np.abs(texels[5, ..., :3] - root).max() <= 0.5 + 1e-3
    far, near = field.range_px
    assert far <= -2
    assert near >= 3
    assert texels[5, ..., 3] / 255 * (near - far) + far == pytest.approx(disparity, abs=(near - far) / 500)
    stored = np.frombuffer(field.disparities.read(), np.float16).reshape(6, 4, 8)
    assert stored[5] == pytest.approx(disparity, abs=2e-3)
    assert field.present.sum() == field.has_disparity.sum() == 1
    assert field.present[1, 2]
    field.release()


@pytest.mark.parametrize(
    ("box", "hdr"), [(np.s_[0:37, 0:53], True), (np.s_[5:6, 7:8], False), (np.s_[15:33, 20:53], False)]
)
def test_a_part_with_other_disparity_leaves_what_all_of_it_anew_would(gl, box, hdr):
    random = np.random.default_rng(0)
    colors = random.integers(0, 255, (37, 53, 3)).astype(np.float16 if hdr else np.uint8)
    before = random.normal(size=(37, 53)).astype(np.float32)
    after = before.copy()
    after[box] = random.uniform(-2, 2, after[box].shape)
    changed, again = (LightFieldTexture(gl.ctx, GRID, 53, 37, hdr, with_disparity=True) for _ in range(2))
    for field in (changed, again):
        field.upload(1, 2, colors, before)
    changed.change_disparity(1, 2, after, box)
    again.upload(1, 2, colors, after)
    for name in ("colors", "disparities"):
        assert getattr(changed, name).read() == getattr(again, name).read(), name
    assert changed.uploads.tolist() == again.uploads.tolist()
    changed.release()
    again.release()


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(("wild", "hdr"), [(-3e38, False), (3.4e38, True)])
def test_the_largest_disparities_stay_finite(gl, wild, hdr):
    field = LightFieldTexture(gl.ctx, GRID, 8, 4, hdr, with_disparity=True)
    colors = np.zeros((4, 8, 3), np.float16 if hdr else np.uint8)
    disparity = np.tile(np.float32([wild, -wild, 0, 1, 2, 3, 4, 5]), (4, 1))
    for column in range(2):
        field.upload(0, column, colors, disparity)
    stored = np.frombuffer(field.disparities.read(), np.float16).reshape(6, 4, 8)[1].astype(np.float32)
    assert (stored == np.clip(disparity, -65504, 65504)).all()
    assert np.isfinite(field.range_px).all()
    alpha = np.frombuffer(field.colors.read(), np.float16 if hdr else np.uint8).reshape(6, 4, 8, 4)[1, 0, :, 3]
    assert alpha[2] < alpha[int(wild < 0)]
    assert alpha[2] > alpha[int(wild > 0)]
    field.release()


def test_too_many_views_say_what_fits(gl):
    side = int(gl.ctx.info["GL_MAX_ARRAY_TEXTURE_LAYERS"] ** 0.5) + 1
    with pytest.raises(InputError, match=rf"{side}x{side} needs {side * side} texture layers.*at most {side - 1}x"):
        LightFieldTexture(gl.ctx, GridShape(side, side), 4, 4, hdr=False, with_disparity=False)


def test_views_longer_than_the_driver_allows_are_told_the_size_that_fits(gl):
    width, height = 5 * gl.max_texture_size // 2, 30
    with pytest.raises(InputError, match=r"the largest photo has \d+ pixels$") as error:
        check_fits(gl.ctx, GridShape(3, 3), width, height)
    fitting = size_within(ImageSize(height, width), int(str(error.value).split()[-2]))
    check_fits(gl.ctx, GridShape(3, 3), fitting.width, fitting.height)
    assert max(fitting) > 0.9 * gl.max_texture_size
