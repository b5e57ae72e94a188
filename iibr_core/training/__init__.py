"""Training of the ray transformer: procedural light fields with exact answers, losses, and the loop itself.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.training.batches import training_batch
    from iibr_core.training.losses import LossWeights
    from iibr_core.training.run_files import checkpoint_path, require_run_files
    from iibr_core.training.trainer import Batch
else:
    __getattr__ = offered_by(__file__)
