"""Photo + disparity -> the views of a light field, one after the other. The paper's loop (section 3), closed-form weights."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from iibr_core.plan import ScenePlan
from iibr_core.types import Disparity, Photo, ViewOffset, ViewUpdate


def generate(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    should_stop: Callable[[], bool] = lambda: False,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
) -> Iterator[ViewUpdate]:
    """Yield every view of `plan.grid` once: the photo's own first, then the farthest, then those nearest to `nearest_to()`.

    disparity is the field's (`plan.field_disparity(given)`). should_stop is asked between row bands of a view; once it is true the
    generator returns. Pixels do not depend on the order of the views.
    """
    raise NotImplementedError
