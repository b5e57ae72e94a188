"""The plan of a photo, and all its views."""

from __future__ import annotations

from collections.abc import Callable, Generator

import numpy as np

from iibr_core.color import photo_in_srgb
from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.generation.disparity_range import measure_disparity_range
from iibr_core.generation.outer_views import ALL_VIEWS, WantedViews
from iibr_core.generation.plan import MOST_STRENGTH, PlanOverrides, ScenePlan, plan_for_viewing, plan_literal
from iibr_core.inpainting.inpainter import InpaintingAids
from iibr_core.scenes.loaded_photo import LoadedPhoto
from iibr_core.scenes.scene import Source
from iibr_core.types import FloatImage, InputError, ReportProgress, ViewOffset, ViewUpdate, ignore_progress


def inpainting_aids(
    source: Source, loaded: LoadedPhoto, report_progress: ReportProgress = ignore_progress
) -> InpaintingAids:
    """Return the aids for inpainting this photo: the estimator of its depth, if that was a model."""
    from iibr_core.depth.search import PhotoWithDepth, estimator_of

    found = PhotoWithDepth(loaded.photo, loaded.found, loaded.origin)
    return InpaintingAids(estimator_of(found, source.depth), report_progress)


def make_plan(source: Source, loaded: LoadedPhoto, depth_strength: float, keeps_views: bool = True) -> ScenePlan:
    """Return the plan for viewing, or for literal disparity. Places without edits keep their parallax.

    keeps_views: else each is written and forgotten. Raises InputError where an override is out of range.
    """
    if source.is_literal:
        if source.grid is None:
            raise InputError("--literal counts disparity in px from view to view: say how many with --grid")
        return plan_literal(loaded.photo, loaded.disparity, source.grid, source.quality, keeps_views, source.inpaint)
    zero = source.focus_disparity
    if loaded.depth_settings.edits != UNEDITED:
        zero = still_disparity(source, loaded.canvas.before_strokes(loaded.depth_settings.edits))
        range_px, edited_px = (
            measure_disparity_range(map_.values).range for map_ in (loaded.refined, loaded.disparity)
        )
        wanted = depth_strength * (edited_px / range_px if range_px else 1.0)
        depth_strength = min(max(wanted, -MOST_STRENGTH), MOST_STRENGTH)
    overrides = PlanOverrides(source.grid, depth_strength, zero, source.quality, source.inpaint)
    return plan_for_viewing(loaded.photo, loaded.disparity, overrides, keeps_views)


def still_disparity(source: Source, before_strokes: FloatImage) -> float:
    """The disparity (as given) of the plane that stays still, wherever the brush goes."""
    return float(np.median(before_strokes)) if source.focus_disparity is None else source.focus_disparity


def views_of_photo(
    source: Source,
    loaded: LoadedPhoto,
    plan: ScenePlan,
    report_progress: ReportProgress = ignore_progress,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
    draft_bytes: int | None = None,
    in_srgb: bool = True,
    wanted: Callable[[], WantedViews] = lambda: ALL_VIEWS,
) -> Generator[ViewUpdate]:
    """Yield the views as `generate` does, in sRGB or in the photo's colour space. Raises InputError as that does."""
    from iibr_core.generation.light_field import generate

    photo, disparity = loaded.photo, plan.field_disparity(loaded.disparity)
    aids = inpainting_aids(source, loaded, report_progress)
    return generate(
        photo_in_srgb(photo) if in_srgb else photo,
        disparity,
        plan,
        nearest_to,
        source.quality,
        source.inpaint,
        draft_bytes,
        aids,
        wanted,
    )
