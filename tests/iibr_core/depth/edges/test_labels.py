import numpy as np
import pytest
from scipy import ndimage

from iibr_core.depth.edges.labels import label_edges
from tests.iibr_core.depth.test_sheets import assert_sheet
from tests.iibr_core.scenes import smooth_texture

EDGE, NEAR, FAR = 0.3, 5.0, 1.0


def test_labels_of_any_outline_follow_the_photo(regenerate_golden, tmp_path):
    """Outlines up to the frame, textures like their difference: every pixel that tells colours counts somewhere."""
    rng, size = np.random.default_rng(2), (60, 80)
    truth = np.where(ndimage.gaussian_filter(rng.normal(size=size), 4) > 0, NEAR, FAR).astype(np.float32)
    light = np.where(truth == NEAR, 0.35, 0.2)[..., None] + rng.normal(0, 0.03, (*size, 3))
    photo = (0.25 * smooth_texture(*size) + light).astype(np.float32)
    unknown, known = rng.random(size) < 0.05, np.zeros(size, np.bool_)
    given = ndimage.minimum_filter(truth, 3), ndimage.maximum_filter(truth, 5), np.roll(truth, 2, axis=1)
    found = [label_edges(photo, values, where, EDGE) for values in given for where in (known, unknown)]
    wrong = [np.count_nonzero(values != truth) for values in (*given, *found)]
    assert all(2 * after < wrong[k // 2] for k, after in enumerate(wrong[3:])), wrong
    assert_sheet("labels", [truth, *given, *found], (0, 6), 5, regenerate_golden, tmp_path)


@pytest.mark.parametrize("column", [50, 51])
def test_a_wire_of_a_dilated_map_stays_also_beside_its_place(column):
    truth = np.full((60, 60), FAR, np.float32)
    truth[20:41, 20:41] = NEAR
    noise = np.random.default_rng(3).normal(0, 0.01, (60, 60, 3))
    photo = 0.06 * smooth_texture(60, 60) + np.where(truth == NEAR, 0.69, 0.125)[..., None] + 0.25 * noise
    photo[:, column] = 0.1, 0.6, 0.1
    wire = truth.copy()
    wire[:, 50] = NEAR
    given = ndimage.maximum_filter(wire, 3) if column == 50 else np.maximum(ndimage.maximum_filter(truth, 3), wire)
    labelled = label_edges(photo.astype(np.float32), given, np.zeros(given.shape, np.bool_), EDGE)
    assert (labelled[:, 50] == NEAR).all()
