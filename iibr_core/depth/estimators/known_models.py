"""The families of depth estimators. Each imports what runs it when it runs; this file is light."""

from __future__ import annotations

from iibr_core.depth.estimators import depth_anything_3, onnx_models, transformers_models, unidepth

FAMILIES = (
    onnx_models.FAMILY,
    transformers_models.FAMILY,
    depth_anything_3.FAMILY,
    unidepth.FAMILY,
)
"""A user's folder belongs to the first that accepts it."""
