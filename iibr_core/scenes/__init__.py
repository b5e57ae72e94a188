"""What is open: a photo or a light field from its file to its last view, without window and threads.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.scenes.dense import read_dense
    from iibr_core.scenes.inputs import inputs_of, named_by
    from iibr_core.scenes.lens_limits import (
        BLADES_LIMITS,
        LensChoice,
        aperture_limit,
        clamp,
        clamp_eye,
        clamp_optics,
        clamp_to_grid,
        dolly_limit,
        eye_limits,
        first_aperture,
        focus_limits,
        focus_span,
        has_sound_gloss,
        is_finite,
    )
    from iibr_core.scenes.light_fields import find_disparity
    from iibr_core.scenes.loaded_photo import (
        LoadedPhoto,
        deepen,
        load_photo,
        prepare_brush,
        without_history,
    )
    from iibr_core.scenes.making import inpainting_aids, make_plan, still_disparity, views_of_photo
    from iibr_core.scenes.opening import (
        SceneReady,
        SceneRequest,
        ViewReady,
        WantedPhoto,
        results_of,
        scene_of_photo,
        sketch_of,
    )
    from iibr_core.scenes.rect import WHOLE, Rect
    from iibr_core.scenes.scene import (
        AS_FOUND,
        DepthSettings,
        FilledField,
        Progress,
        Scene,
        Source,
        is_same_field,
        source_beside,
        source_with_depth,
        source_with_map,
    )
    from iibr_core.scenes.scene_gloss import GlossFound, GlossRequest, add_gloss, answer, read_environment
    from iibr_core.scenes.screen_size import ScreenSize
else:
    __getattr__ = offered_by(__file__)
