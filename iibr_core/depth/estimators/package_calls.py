"""What families share whose models come as a package of their own, with its own way of preparing photos.

Such packages are not part of this project's environment; one that is not installed is told in one line.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.estimators.depth_estimator import LocalModel, Run
from iibr_core.formats.files import reason_of
from iibr_core.types import (
    FloatImage,
    ImageSize,
    InputError,
    Photo,
)

# What foreign packages raise for weights or photos that do not suit them.
FAILURES = (OSError, ValueError, RuntimeError, KeyError, TypeError, ImportError, AttributeError, AssertionError)


def prepare_by(call: Callable[[LocalModel, Photo], DepthEstimate]) -> Callable[..., tuple[object, Run]]:
    """A family's `prepare`, of one call that makes everything; what the package raises becomes InputError."""

    def prepare(model: LocalModel, size: ImageSize, memory_bytes: int) -> tuple[object, Run]:
        def run(photo: Photo) -> DepthEstimate:
            try:
                return call(model, photo)
            except FAILURES as error:
                if isinstance(error, InputError):
                    raise
                raise InputError(f"{model.title} ({model.family.packages[0]}) failed: {reason_of(error)}") from error

        return None, run

    return prepare


def positive(said: Any) -> FloatImage:
    """A package's distances, a tensor or an array; the sky and the like is infinite or 0 there: unknown."""
    depth = np.asarray(said.cpu() if hasattr(said, "cpu") else said, np.float32)
    return np.where(np.isfinite(depth) & (depth > 0), depth, np.float32(np.nan))
