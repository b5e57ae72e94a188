"""The trained ray transformer T of the paper (section 3.2): weights from ray coordinates and disparity alone.

This is the arithmetic of `training.model.RayTransformer` as one loop. Importing torch takes longer than making a light
field; for networks this small a compiled loop is as fast.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from iibr_core.formats.weights import read_weights, require_shapes
from iibr_core.method.ambiguous_rays import FEATURES, SHARE, AmbiguousRays
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import FloatImage

WIDTH = 16
MIN_PRIOR = 0.02
"""Prior that is added to the closed form's weight: a surface without weight may still win."""
RAYS_A_BLOCK = 64
"""Number of rays side by side in vector registers; few enough for the first cache."""
SHAPES = {
    "embed.0.weight": (WIDTH, FEATURES),
    "embed.0.bias": (WIDTH,),
    "embed.2.weight": (WIDTH, WIDTH),
    "embed.2.bias": (WIDTH,),
    "key.weight": (WIDTH, WIDTH),
    "key.bias": (WIDTH,),
    "query.weight": (WIDTH, 2 * WIDTH),
    "score.weight": (1, WIDTH),
}


class TrainedWeights:
    """The weights of a RayTransformer from a file, called with ambiguous rays. Safe to call from several threads."""

    def __init__(self, path: Path) -> None:
        """Raises InputError for a file that is not such weights."""
        tensors, self.metadata = read_weights(path)
        require_shapes(path, tensors, SHAPES)
        self._layers = tuple(np.ascontiguousarray(tensors[name].T) for name in SHAPES)

    def __call__(self, ambiguous: AmbiguousRays) -> FloatImage:
        """Return weights (N, K), 0 for unused hypotheses; rows sum to 1."""
        weights = np.zeros(ambiguous.disparity.shape, np.float32)
        _weigh(ambiguous.features, ambiguous.number, self._layers, weights)
        return weights


@cache
def shipped_transformer() -> TrainedWeights:
    """Return the transformer that comes with the program. Raises InputError if its file cannot be read."""
    return TrainedWeights(resource_folder("assets") / "weights" / "ray_transformer.safetensors")


@kernel
def _add_product(inputs, w, outputs, lanes):
    """Add to outputs (J, L) w (I, J) transposed times inputs (I, L), four at a time; I is a multiple of 4."""
    for j in range(w.shape[1]):
        out = outputs[j]
        for i in range(0, w.shape[0], 4):
            # Four inputs at a time: one load and store of the output for four products.
            a, b, c, d = w[i, j], w[i + 1, j], w[i + 2, j], w[i + 3, j]
            x, y, z, u = inputs[i], inputs[i + 1], inputs[i + 2], inputs[i + 3]
            for lane in range(lanes):
                out[lane] += a * x[lane] + b * y[lane] + c * z[lane] + d * u[lane]


@kernel
def _add_prior(score, share, start, weights):
    """Weights (R, K) of rays whose hypotheses have these scores and shares, those of ray r in [start[r], start[r + 1]).

    The closed form as prior: its weights are added as logarithms. Softmax, less the highest score against overflow.
    """
    for r in range(len(weights)):
        highest, total = np.float32(-np.inf), np.float32(0.0)
        for lane in range(start[r], start[r + 1]):
            prior = min(max(share[lane], np.float32(0.0)), np.float32(1.0)) + np.float32(MIN_PRIOR)
            score[lane] += np.float32(np.log(prior))
            highest = max(highest, score[lane])
        for lane in range(start[r], start[r + 1]):
            weights[r, lane - start[r]] = np.exp(score[lane] - highest)
            total += weights[r, lane - start[r]]
        for a in range(start[r + 1] - start[r]):
            weights[r, a] /= total


@kernel
def _weigh(features, number, layers, weights):
    """Write the weights (N, K) of rays, see `TrainedWeights`. layers: transposed arrays in the order of SHAPES.

    Arrays are (unit, lane). The hypotheses of a block's rays lie one after the other in lanes [start, end).
    """
    w1, b1, w2, b2, w_key, b_key, w_query, w_score = layers
    rays, most = weights.shape
    inputs = np.empty((features.shape[2], most * RAYS_A_BLOCK), np.float32)
    hidden = np.empty((WIDTH, most * RAYS_A_BLOCK), np.float32)
    embedded = np.empty((WIDTH, most * RAYS_A_BLOCK), np.float32)
    pooled = np.empty((2 * WIDTH, RAYS_A_BLOCK), np.float32)
    query = np.empty((WIDTH, RAYS_A_BLOCK), np.float32)
    score = np.empty(most * RAYS_A_BLOCK, np.float32)
    start = np.zeros(RAYS_A_BLOCK + 1, np.int64)
    zero = np.float32(0.0)
    for first in range(0, rays, RAYS_A_BLOCK):
        count = min(RAYS_A_BLOCK, rays - first)
        # Pack the hypotheses in use: unused ones cost nothing, and no mask is needed below.
        for r in range(count):
            used = np.int64(number[first + r])
            start[r + 1] = start[r] + used
            for a in range(used):
                for i in range(len(inputs)):
                    inputs[i, start[r] + a] = features[first + r, a, i]
        lanes = start[count]
        # Biases. That of the keys is added once a ray, to its query.
        for j in range(WIDTH):
            hidden[j, :lanes], embedded[j, :lanes], query[j] = b1[j], b2[j], b_key[j]
        # Embedding: two layers with ReLU, the second one's below.
        _add_product(inputs, w1, hidden, lanes)
        for j in range(WIDTH):
            for lane in range(lanes):
                hidden[j, lane] = max(hidden[j, lane], zero)
        _add_product(hidden, w2, embedded, lanes)
        # Pooling over the hypotheses of each ray: their mean and maximum.
        for j in range(WIDTH):
            for r in range(count):
                total = peak = zero
                for lane in range(start[r], start[r + 1]):
                    value = max(embedded[j, lane], zero)
                    embedded[j, lane] = value
                    total, peak = total + value, max(peak, value)
                pooled[j, r], pooled[WIDTH + j, r] = total / np.float32(max(start[r + 1] - start[r], 1)), peak
        # Query from the pooled ray, keys from its hypotheses; hidden begins as the query.
        _add_product(pooled, w_query, query, count)
        for j in range(WIDTH):
            for r in range(count):
                hidden[j, start[r] : start[r + 1]] = query[j, r]
        _add_product(embedded, w_key, hidden, lanes)
        # Additive attention: score = w . ReLU(query + key).
        score[:] = zero
        for j in range(WIDTH):
            for lane in range(lanes):
                score[lane] += max(hidden[j, lane], zero) * w_score[j, 0]
        _add_prior(score, inputs[SHARE], start[: count + 1], weights[first : first + count])
