"""ScenePlan: what this scene needs, and why. Nothing is modelled that the disparity does not ask for."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.types import Disparity, GridShape, Photo


@dataclass(frozen=True)
class PlanOverrides:
    """What the user decided; None leaves the choice to the plan.

    depth_strength multiplies the parallax the plan chose; focus_disparity (px per view step, as given) is the plane that stays still.
    """

    grid: GridShape | None = None
    depth_strength: float = 1.0
    focus_disparity: float | None = None
    memory_bytes: int | None = None


@dataclass(frozen=True)
class ScenePlan:
    """The choices for one scene.

    grid: stored views. disparity_scale, disparity_zero: the field's disparity is (given - zero) * scale.
    disparity_range_px: least and greatest field disparity (px per view step). edge_fraction: share of pixels within 3 px of a
    depth edge. has_disocclusion: whether any view shows what the photo hides. field_bytes, peak_bytes: memory of the light
    field, and at most while generating. reasons: the same in sentences.
    """

    grid: GridShape
    disparity_scale: float
    disparity_zero: float
    disparity_range_px: tuple[float, float]
    edge_fraction: float
    has_disocclusion: bool
    field_bytes: int
    peak_bytes: int
    reasons: tuple[str, ...]

    def field_disparity(self, given: Disparity) -> Disparity:
        """The disparity the light field is generated from (px per view step of this plan's grid)."""
        values = (given.values - self.disparity_zero) * self.disparity_scale
        return Disparity(values.astype(given.values.dtype), given.source, given.notes)


def plan_for_viewing(photo: Photo, disparity: Disparity, overrides: PlanOverrides = PlanOverrides()) -> ScenePlan:  # noqa: B008
    """Plan for the viewer: picks baseline, focus plane and grid."""
    raise NotImplementedError


def plan_literal(photo: Photo, disparity: Disparity, grid: GridShape, memory_bytes: int | None = None) -> ScenePlan:
    """Plan for `iibr generate --grid`: the given disparity is taken as it is, views at integer steps."""
    raise NotImplementedError
