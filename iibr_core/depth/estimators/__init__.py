"""Trained depth models: which there are, where they lie, how they run.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.depth.estimators.catalog import (
        KNOWN_MODELS,
        fetch,
        known_model,
        model_here,
        model_to_use,
        register,
        state_of,
    )
    from iibr_core.depth.estimators.depth_estimator import KnownModel
    from iibr_core.depth.estimators.own_models import list_own_models
    from iibr_core.depth.estimators.words import words_about
else:
    __getattr__ = offered_by(__file__)
