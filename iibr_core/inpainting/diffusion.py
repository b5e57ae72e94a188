"""Large gaps painted by a latent-diffusion model from a local folder; all other holes filled by `background`.

Painted pixels get their disparity from the model that found the photo's depth, if there is one (the paper's
D_new = F(I_new)), aligned to the known disparity around the gap; else the surfaces at the border continue.
torch and diffusers are imported when the folder is loaded.
"""

from __future__ import annotations

import os
import threading
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.registry import EstimateDepth
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.types import FloatImage, ImageSize, InputError, ViewOffset, image_size

LARGE_PX = 8
"""Side in pixels of the squares that a large gap consists of: a smaller gap is only a few latents."""
STEPS = 30
"""Number of denoising steps."""
USUAL_SIDE = 512
"""Longer side in pixels of pictures for models that do not state their size."""
BORDER_PX = 12
"""Distance from a gap, in pixels, within which estimated disparity is aligned to known disparity."""
MIN_BORDER_PIXELS = 16
"""Least number of known pixels for an alignment."""


class DiffusionInpainter:
    """An `Inpainter` that paints one view at a time, because one fills the memory."""

    def __init__(self, folder: str, estimate_depth: EstimateDepth | None) -> None:
        """Load the pipeline. Raises InputError if the folder holds none or diffusers is not installed."""
        require_extra("diffusion", "diffusers", "transformers", "torch")
        self._folder, self._estimate_depth = folder, estimate_depth
        self._pipeline = _load_pipeline(folder)
        self._turn = threading.Lock()

    def __call__(
        self,
        colors: FloatImage,
        disparity: FloatImage,
        hole: NDArray[np.bool_],
        photo_disparity: FloatImage,
        offset: ViewOffset,
        threads: int = 1,
    ) -> None:
        """Fill a view, see `Inpainter`; the model paints large gaps only. Raises InputError if memory runs out."""
        fill_background(colors, disparity, hole, photo_disparity, offset, threads)
        large = large_gaps(hole)
        if not large.any():
            return
        with self._turn:
            colors[large] = self._paint(colors, large)[large]
            if self._estimate_depth is not None:
                align_in_gaps(self._estimate_depth(colors), disparity, hole, large)

    def _paint(self, colors: FloatImage, large: NDArray[np.bool_]) -> FloatImage:
        """Return the view (H, W, 3) as the model paints it."""
        import torch

        raise_if_stopped()
        size = self._model_size(image_size(colors))
        picture = _resized(torch.from_numpy(np.clip(colors, 0, 1)).permute(2, 0, 1)[None], size)
        mask = (_resized(torch.from_numpy(large.astype(np.float32))[None, None], size) > 0).float()
        try:
            painted = self._pipeline(
                prompt="", image=picture, mask_image=mask, height=size.height, width=size.width,
                num_inference_steps=STEPS, generator=torch.Generator().manual_seed(0), output_type="pt",
                callback_on_step_end=_after_step,
            ).images  # fmt: skip
        except torch.OutOfMemoryError as error:
            raise InputError(f"{self._folder}: out of memory; use a smaller photo or a smaller model") from error
        enlarged = _resized(painted.float().cpu(), image_size(colors))[0].permute(1, 2, 0)
        return np.asarray(np.nan_to_num(enlarged.numpy()).clip(0, 1), np.float32)

    def _model_size(self, size: ImageSize) -> ImageSize:
        """Return the (height, width) of the model's input: its usual size along the longer side, whole latents."""
        factor, unet = self._pipeline.vae_scale_factor, getattr(self._pipeline, "unet", None)
        side, multiple = getattr(getattr(unet, "config", None), "sample_size", None), max(factor, 8)
        longer_px = max(side * factor if isinstance(side, int) else USUAL_SIDE, multiple)
        shrink = min(longer_px / max(size), 1.0)
        return ImageSize(*(max(round(length * shrink / multiple), 1) * multiple for length in size))


def _after_step(pipeline: Any, step: int, timestep: Any, tensors: dict[str, Any]) -> dict[str, Any]:
    """Report progress after a denoising step and stop a cancelled job: the pipeline's callback."""
    report_progress(step + 1, STEPS, "painting what no view of the photo shows")
    raise_if_stopped()
    return tensors


def large_gaps(hole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the pixels (H, W) of all squares of LARGE_PX a side that fit into the holes, a morphological opening."""
    if min(hole.shape) < LARGE_PX:
        return np.zeros_like(hole)
    fits = sliding_window_view(hole, (LARGE_PX, 1)).all(axis=(-2, -1))
    fits = sliding_window_view(fits, (1, LARGE_PX)).all(axis=(-2, -1))
    return _any_within(np.pad(fits, LARGE_PX - 1), LARGE_PX)


def _any_within(mask: NDArray[np.bool_], side: int) -> NDArray[np.bool_]:
    """Return for each square of side x side pixels whether the mask is True anywhere in it."""
    rows = sliding_window_view(mask, (side, 1)).any(axis=(-2, -1))
    return np.asarray(sliding_window_view(rows, (1, side)).any(axis=(-2, -1)))


def align_in_gaps(
    inverse_depth: FloatImage, disparity: FloatImage, hole: NDArray[np.bool_], large: NDArray[np.bool_]
) -> None:
    """Write disparity (H, W) in large gaps: inverse_depth (H, W), fitted to the known disparity around them.

    The result stays within the range of that. Disparity does not change where too few pixels are known or where the
    fit would swap near and far.
    """
    border = _any_within(np.pad(large, BORDER_PX), 2 * BORDER_PX + 1) & ~hole & np.isfinite(inverse_depth)
    if border.sum() < MIN_BORDER_PIXELS or not np.isfinite(inverse_depth[large]).all():
        return
    x, y = inverse_depth[border].astype(np.float64), disparity[border].astype(np.float64)
    (variance, covariance), _ = np.cov(x, y)
    if variance > 0 and covariance > 0:
        fitted = y.mean() + covariance / variance * (inverse_depth[large] - x.mean())
        disparity[large] = np.clip(fitted, y.min(), y.max())


def _load_pipeline(folder: str) -> Any:
    """Return the pipeline, on the GPU if there is one. Raises InputError."""
    import diffusers.utils.logging
    import torch
    import transformers.utils.logging

    # Before the pipelines are imported, which warn about optional packages.
    for logging in (diffusers.utils.logging, transformers.utils.logging):
        logging.set_verbosity_error()
        logging.disable_progress_bar()
    from diffusers import AutoPipelineForInpainting

    try:
        pipeline = AutoPipelineForInpainting.from_pretrained(
            os.path.expanduser(folder), local_files_only=True, use_safetensors=True, low_cpu_mem_usage=False
        )
        pipeline.set_progress_bar_config(disable=True)
        return pipeline.to("cuda" if torch.cuda.is_available() else "cpu")
    except Exception as error:  # diffusers, torch and safetensors raise errors of many kinds for unsuitable folders
        raise InputError(f"{folder}: cannot be loaded as an inpainting pipeline ({str(error)[:160]})") from error


def _resized(image: Any, size: ImageSize) -> Any:
    """Return a tensor (1, C, H, W) at another size."""
    import torch

    return torch.nn.functional.interpolate(image, tuple(size), mode="bilinear", antialias=True)
