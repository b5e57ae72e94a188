"""Large gaps painted by a latent-diffusion model from a local folder; all else as `background` fills it.

What was painted gets its disparity from the estimator that gave the photo's, where there is one (the paper's
D_new = F(I_new)), aligned to what is known around the gap; else surfaces go on from the border.
torch and diffusers are imported when the folder is loaded.
"""

from __future__ import annotations

import os
import threading
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.inpainter import Inpainter, InpaintingAids
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import Cancelled, raise_if_stopped, report_progress
from iibr_core.types import (
    FloatImage,
    ImageSize,
    InputError,
    ViewOffset,
    image_size,
)

LARGE_PX = 8
"""Gaps are large where a square of so many pixels a side lies in them: a smaller one is a few latents."""
STEPS = 30
USUAL_SIDE = 512
"""Pictures are shown to models that do not tell their size with this many pixels along the longer side."""
BORDER_PX = 12
"""Estimated disparity is aligned to what is known so near a gap, and stays within it."""
LEAST_BORDER = 16
"""Pixels, to align by."""


class DiffusionInpainter:
    """An `Inpainter`: threads take turns, for one view fills the memory."""

    def __init__(self, folder: str, aids: InpaintingAids) -> None:
        """Load the pipeline. Raises InputError where the folder holds none, or diffusers is not installed."""
        require_extra("diffusion", "diffusers", "transformers", "torch")
        self._folder, self._aids = folder, aids
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
        """As `Inpainter` says; the model is asked only where a gap is large. Raises InputError where it fails."""
        fill_background(colors, disparity, hole, photo_disparity, offset, threads)
        large = large_gaps(hole)
        if not large.any():
            return
        with self._turn:
            colors[large] = self._paint(colors, large)[large]
            if self._aids.estimate_depth is not None:
                estimate = self._aids.estimate_depth(colors)
                align_in_gaps(estimate, disparity, hole, large)

    def _paint(self, colors: FloatImage, large: NDArray[np.bool_]) -> FloatImage:
        """The view (H, W, 3) as the model paints it, at its size and back."""
        import torch

        size = self._size_for(image_size(colors))
        shown = _resized(torch.from_numpy(np.clip(colors, 0, 1)).permute(2, 0, 1)[None], size)
        mask = (_resized(torch.from_numpy(large.astype(np.float32))[None, None], size) > 0).float()
        stop = partial(_before_layer)
        parts = (part for part in self._pipeline.components.values() if isinstance(part, torch.nn.Module))
        hooks = [layer.register_forward_pre_hook(stop) for part in parts for layer in part.modules()]
        try:
            painted = self._pipeline(
                prompt="", image=shown, mask_image=mask, height=size.height, width=size.width,
                num_inference_steps=STEPS, generator=torch.Generator().manual_seed(0), output_type="pt",
                callback_on_step_end=self._report_step,
            ).images  # fmt: skip
        except (torch.OutOfMemoryError, MemoryError) as error:
            raise InputError(f"{self._folder}: out of memory; lower --max-pixels or give a smaller model") from error
        except Cancelled:
            raise
        except Exception as error:  # pipelines raise whatever their parts do
            raise InputError(f"{self._folder}: failed to paint ({str(error)[:160]})") from error
        finally:
            for hook in hooks:
                hook.remove()
        raise_if_stopped()
        back = _resized(painted.float().cpu(), image_size(colors))[0].permute(1, 2, 0)
        return np.asarray(np.nan_to_num(back.numpy()).clip(0, 1), np.float32)

    def _size_for(self, size: ImageSize) -> ImageSize:
        """The (height, width) at which the model sees a view: its own along the longer side, whole latents."""
        multiple = 8 * max(int(getattr(self._pipeline, "vae_scale_factor", 8)) // 8, 1)
        unet = getattr(self._pipeline, "unet", None)
        own = getattr(getattr(unet, "config", None), "sample_size", None)
        side = own * self._pipeline.vae_scale_factor if isinstance(own, int) else USUAL_SIDE
        shrink = min(max(side, multiple) / max(size), 1.0)
        return ImageSize(*(max(round(length * shrink / multiple), 1) * multiple for length in size))

    def _report_step(self, pipeline: Any, step: int, timestep: Any, tensors: dict[str, Any]) -> dict[str, Any]:
        report_progress(step + 1, STEPS, "painting what no view of the photo shows")
        return tensors


def diffusion_inpainter(folder: str, aids: InpaintingAids) -> Inpainter:
    """For the registry. Raises InputError where the folder holds no inpainting pipeline."""
    return DiffusionInpainter(folder, aids)


def large_gaps(hole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(H, W): the pixels of holes that squares of LARGE_PX a side fit into (a morphological opening)."""
    if min(hole.shape) < LARGE_PX:
        return np.zeros_like(hole)
    inside = np.lib.stride_tricks.sliding_window_view(hole, LARGE_PX, axis=0).all(axis=-1)
    inside = np.lib.stride_tricks.sliding_window_view(inside, LARGE_PX, axis=1).all(axis=-1)
    rows = np.pad(inside, ((LARGE_PX - 1,) * 2, (LARGE_PX - 1,) * 2))
    covered = np.lib.stride_tricks.sliding_window_view(rows, LARGE_PX, axis=0).any(axis=-1)
    return np.asarray(np.lib.stride_tricks.sliding_window_view(covered, LARGE_PX, axis=1).any(axis=-1))


def align_in_gaps(
    inverse_depth: FloatImage, disparity: FloatImage, hole: NDArray[np.bool_], large: NDArray[np.bool_]
) -> None:
    """Write disparity (H, W) where large: inverse_depth (H, W), any scale > 0, fitted to what is known around the gaps.

    Within the range of what is known there. Where too little is, or the fit says the opposite, it stays as it is.
    """
    near = np.lib.stride_tricks.sliding_window_view(np.pad(large, BORDER_PX), (2 * BORDER_PX + 1, 1)).any(axis=(-2, -1))
    near = np.lib.stride_tricks.sliding_window_view(near, 2 * BORDER_PX + 1, axis=1).any(axis=-1)
    border = near & ~hole & np.isfinite(inverse_depth)
    if border.sum() < LEAST_BORDER or not np.isfinite(inverse_depth[large]).all():
        return
    x, y = inverse_depth[border].astype(np.float64), disparity[border].astype(np.float64)
    spread = float(np.mean((x - x.mean()) ** 2))
    slope = float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread > 0 else 0.0
    if slope > 0:
        fitted = y.mean() + slope * (inverse_depth[large] - x.mean())
        disparity[large] = np.clip(fitted, y.min(), y.max())


def _load_pipeline(folder: str) -> Any:
    """Ready to run, on the GPU if there is one. Raises InputError."""
    import diffusers.utils.logging
    import torch
    import transformers.utils.logging

    # Before the pipelines are imported: what they say of packages that they do without is nobody's business.
    for said in (diffusers.utils.logging, transformers.utils.logging):
        said.set_verbosity_error()
        said.disable_progress_bar()
    from diffusers import AutoPipelineForInpainting

    try:
        pipeline = AutoPipelineForInpainting.from_pretrained(
            os.path.expanduser(folder), local_files_only=True, use_safetensors=True, low_cpu_mem_usage=False
        )
        pipeline.set_progress_bar_config(disable=True)
        return pipeline.to("cuda" if torch.cuda.is_available() else "cpu")
    except (torch.OutOfMemoryError, MemoryError) as error:
        raise InputError(f"{folder}: out of memory; give a smaller model") from error
    except Exception as error:  # diffusers, torch, safetensors raise what they like for folders of something else
        raise InputError(f"{folder}: cannot be loaded as an inpainting pipeline ({str(error)[:160]})") from error


def _resized(image: Any, size: ImageSize) -> Any:
    """A tensor (1, C, H, W) at another size."""
    import torch

    return torch.nn.functional.interpolate(image, tuple(size), mode="bilinear", antialias=True)


def _before_layer(*_: object) -> None:
    raise_if_stopped()
