"""All views of a light field, and what making them takes.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.generation.disparity_range import measure_disparity_range
    from iibr_core.generation.free_views import (
        FreeViews,
        depths_of,
        fitted_cameras,
        inverse_depth_of,
        reach_of,
        steered,
    )
    from iibr_core.generation.light_field import ray_set, transformer_for
    from iibr_core.generation.memory_model import (
        PHOTO_BYTES,
        READING_BYTES,
        budget_of,
        require_free_views,
        require_picture,
        require_process,
        whole_bytes,
    )
    from iibr_core.generation.outer_views import ALL_VIEWS, WantedViews
    from iibr_core.generation.plan import ScenePlan, plan_literal
    from iibr_core.generation.stored_views import encode_for_storage, stored_colors
else:
    __getattr__ = offered_by(__file__)
