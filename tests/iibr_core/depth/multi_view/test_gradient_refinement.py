"""The solver of the refinement against a dense one, and its weights at edges."""

import numpy as np

from iibr_core.depth.multi_view import gradient_refinement
from iibr_core.depth.multi_view.gradient_refinement import _apply, _diagonal, _measure, _smooth, _weigh_bends

SIZE = 6, 7


def dense(curvature, across, down):
    """(N, N): curvature and the squares of weighted second differences along rows and columns."""
    matrix = np.diag(curvature.ravel().astype(float))
    number = np.arange(curvature.size).reshape(SIZE)
    for weights, numbers in ((across, number), (down.T, number.T)):
        for (y, x), weight in np.ndenumerate(weights):
            if 0 < x < weights.shape[1] - 1:
                row = np.zeros(curvature.size)
                row[numbers[y, x - 1 : x + 2]] = 1, -2, 1
                matrix += weight * np.outer(row, row)
    return matrix


def weights(seed=0):
    """curvature, across, down: positive; the latter 0 at the borders they do not reach."""
    curvature, across, down = np.random.default_rng(seed).random((3, *SIZE)).astype(np.float32)
    across[:, [0, -1]] = down[[0, -1]] = 0
    return curvature, across, down


def test_the_matrix_is_curvature_and_squares_of_bends():
    parts, values = weights(), np.random.default_rng(1).normal(0, 1, SIZE).astype(np.float32)
    product = np.empty(SIZE, np.float32)
    _apply(values, *parts, product)
    np.testing.assert_allclose(product.ravel(), dense(*parts) @ values.ravel(), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(_diagonal(*parts).ravel(), np.diag(dense(*parts)), rtol=1e-5)


def test_smoothing_solves_the_equations():
    parts, target = weights(2), np.random.default_rng(3).normal(0, 1, SIZE).astype(np.float32)
    found = _smooth(np.zeros(SIZE, np.float32), target, *parts)
    expected = np.linalg.solve(dense(*parts), (parts[0] * target).ravel())
    np.testing.assert_allclose(found.ravel(), expected, atol=2e-3)


def test_bends_weigh_less_at_edges_of_the_picture_and_of_the_map():
    luma, disparity = np.zeros(SIZE, np.float32), np.zeros(SIZE, np.float32)
    luma[:, 3:] = 0.1
    disparity[4:] = 1.0
    across, down = np.zeros(SIZE, np.float32), np.zeros(SIZE, np.float32)
    _weigh_bends(luma, disparity, across, down)
    usual = gradient_refinement.SMOOTHNESS
    np.testing.assert_allclose(across[:, [1, 4, 5]], usual)
    np.testing.assert_allclose(across[:, [2, 3]], usual * np.exp(-0.1 / gradient_refinement.EDGE_LUMA), rtol=1e-5)
    np.testing.assert_allclose(down[[1, 2]], usual)
    bend = 1 / gradient_refinement.EDGE_DISPARITY
    np.testing.assert_allclose(down[[3, 4]], usual / (1 + bend**2) ** 2, rtol=1e-5)
    assert not across[:, [0, -1]].any()
    assert not down[[0, -1]].any()


def test_curvature_and_pull_lead_to_the_disparity_at_which_views_agree():
    """Views of a texture that is linear: one step of Newton's is exact, however the views stand."""
    y, x = np.mgrid[:12, :14].astype(np.float32)

    def texture(y, x):
        return (0.002 * x - 0.001 * y).astype(np.float32)

    offsets = np.float32([(0, 0), (0, 1), (1, 0), (-1, 2), (1, 1)])
    truth, start = 0.3, np.full((12, 14), 0.25, np.float32)
    textures = np.stack([texture(y + truth * t, x + truth * s) for t, s in offsets])
    curvature, pull = np.empty((12, 14), np.float32), np.empty((12, 14), np.float32)
    _measure(textures, offsets, start, 0, 12, curvature, pull)
    inside = np.s_[2:-2, 2:-2]
    np.testing.assert_allclose(start[inside] - pull[inside] / curvature[inside], truth, atol=2e-3)
