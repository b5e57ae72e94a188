"""The solver of the refinement against a dense one, and its measured curvature."""

import numpy as np

from iibr_core.depth.multi_view.refinement import _apply, _diagonal, _measure, _smooth

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


def test_smoothing_solves_the_equations():
    parts = np.random.default_rng(2).random((3, *SIZE)).astype(np.float32)
    parts[1, :, [0, -1]] = parts[2, [0, -1]] = 0
    values, product = np.random.default_rng(1).normal(0, 1, SIZE).astype(np.float32), np.empty(SIZE, np.float32)
    _apply(values, *parts, product)
    np.testing.assert_allclose(product.ravel(), dense(*parts) @ values.ravel(), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(_diagonal(*parts).ravel(), np.diag(dense(*parts)), rtol=1e-5)
    found = _smooth(np.zeros(SIZE, np.float32), values, *parts)
    expected = np.linalg.solve(dense(*parts), (parts[0] * values).ravel())
    np.testing.assert_allclose(found.ravel(), expected, atol=2e-3)


def test_curvature_and_pull_lead_to_the_disparity_at_which_views_agree():
    """Views of a texture that is linear: one step of Newton's is exact, however the views are placed."""
    y, x = np.mgrid[:12, :14].astype(np.float32)
    offsets = np.float32([(0, 0), (0, 1), (1, 0), (-1, 2), (1, 1)])
    truth, start = 0.3, np.full((12, 14), 0.25, np.float32)
    textures = np.stack([0.002 * (x + truth * s) - 0.001 * (y + truth * t) for t, s in offsets]).astype(np.float32)
    curvature, pull = np.empty((12, 14), np.float32), np.empty((12, 14), np.float32)
    _measure(textures, offsets, start, 0, 12, curvature, pull)
    inside = np.s_[2:-2, 2:-2]
    np.testing.assert_allclose(start[inside] - pull[inside] / curvature[inside], truth, atol=2e-3)
