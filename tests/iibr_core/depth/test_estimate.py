from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimate import OUTLIER_SPANS, DepthEstimate, Meaning, disparity_from
from iibr_core.depth.search import open_with_depth
from iibr_core.depth.stereo_pair import estimate_from_pair
from iibr_core.types import TOTAL_PARALLAX, FloatImage, GridShape, InputError, ViewOffset
from tests.iibr_core.formats.test_view_files import leia_image
from tests.iibr_core.known_scenes import view_of_wall

GRID = GridShape(9, 9)
RAMP = np.linspace(0, 1, 2000, dtype=np.float32).reshape(40, 50)


def disparity(values: FloatImage, meaning: Meaning = "inverse depth", grid: GridShape = GRID) -> FloatImage:
    return disparity_from(DepthEstimate(np.asarray(values, np.float32), meaning), grid)[0]


def test_a_flat_map_has_no_range_and_a_single_view_has_one() -> None:
    assert disparity_from(DepthEstimate(np.full((4, 5), 2, np.float32), "metres"), GRID)[1] is None
    assert not disparity(np.full((4, 5), 2)).any()
    np.testing.assert_allclose(disparity(RAMP, grid=GridShape(1, 1)), 8 * disparity(RAMP), rtol=1e-5)
    nearly_flat = np.where(np.arange(2000).reshape(40, 50) == 7, 3, 2)
    assert disparity(nearly_flat)[0, 7] == pytest.approx(TOTAL_PARALLAX * 50 / 8), "the wider percentiles serve it"


def test_disparity_stays_impossible_distances_are_unknown_and_infinity_is_far() -> None:
    found = disparity([[1.5, -2.5, np.nan], [-np.inf, 0.0, 1.0]], "disparity")
    np.testing.assert_array_equal(found, [[1.5, -2.5, np.nan], [np.nan, 0.0, 1.0]])
    found = disparity([[1, 2, 4, 8], [0, -3, np.nan, np.inf]], "metres")
    np.testing.assert_array_equal(np.isnan(found), [[0, 0, 0, 0], [1, 1, 1, 0]])
    assert found[1, 3] == np.nanmin(found)
    assert (np.diff(found[0]) < 0).all()


def test_a_wild_value_changes_no_other() -> None:
    values, expected = RAMP.copy(), disparity(RAMP)
    values[7, 7] = 1e6
    found = disparity(values)
    low, high = np.percentile(found, [1, 99])
    assert found[7, 7] == pytest.approx(high + OUTLIER_SPANS * (high - low), rel=0.01)
    found[7, 7] = expected[7, 7]
    np.testing.assert_allclose(found, expected, atol=0.01 * np.ptp(expected))


@settings(max_examples=20)
@given(
    hnp.arrays(np.float32, st.tuples(st.integers(0, 8), st.integers(1, 8)), elements=st.floats(width=32)),
    st.sampled_from(get_args(Meaning)),
)
def test_never_infinite_and_never_wholly_unknown(values, meaning) -> None:
    known = values > 0 if meaning == "metres" else np.isfinite(values)
    if not known.any():
        with pytest.raises(InputError, match="no known value"):
            disparity(values, meaning)
        return
    found = disparity(values, meaning)
    assert found.dtype == np.float32
    assert not np.isinf(found).any()
    assert not np.isnan(found).all()


DISPARITY = 2.0


def eye(s: float) -> np.ndarray:
    return np.rint(view_of_wall(ViewOffset(0, s), DISPARITY, (60, 80)) * 255).astype(np.uint8)


def test_a_pair_side_by_side_tells_the_disparity_from_eye_to_eye(tmp_path) -> None:
    path = tmp_path / "wall_SBS.png"
    Image.fromarray(np.hstack([eye(0), eye(1)])).save(path)
    found = estimate_from_pair(path)
    assert found[1] == "side-by-side stereo"
    assert found[0].values.shape == (60, 80)
    assert np.median(np.abs(found[0].values - DISPARITY)) < 0.25  # a smooth wall, half a pixel a step
    Image.fromarray(eye(0)).save(path.with_name("a.png"))
    Image.fromarray(eye(1)).save(path.with_name("b.png"))
    for name, right, sign in (("a.png", "b.png", 1), ("b.png", "a.png", -1)):
        found = open_with_depth(path.with_name(name), DepthChoice(right=str(path.with_name(right)), refine=False))
        assert found.origin.line == "Depth: the photo's two views (stereo, two files)."
        assert np.median(np.abs(found.disparity.values - sign * DISPARITY)) < 0.25
    path.with_name("a.lif").write_bytes(leia_image(eye(0), eye(1)).replace(b'"blob_id": -1', b'"blob_id": 10'))
    for other in ("a.png", "a.lif"):
        assert estimate_from_pair(path.with_name(other)) is None, "no pair, or another picture is shown"
    narrow, mpo = Image.fromarray(eye(1)[:, :50]), path.with_name("a.mpo")
    Image.fromarray(eye(0)).save(mpo, "MPO", save_all=True, append_images=[narrow])
    with pytest.raises(InputError, match=r"a\.mpo: .*80x60 and 50x60"):
        estimate_from_pair(mpo)
