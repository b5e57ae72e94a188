"""Distributions that numpy's generators do not have."""

from __future__ import annotations

from math import exp, log

import numpy as np


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a random number between two positive numbers, whose logarithm is uniform."""
    return exp(rng.uniform(log(low), log(high)))
