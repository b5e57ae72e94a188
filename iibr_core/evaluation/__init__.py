"""How good and how fast: judged against light fields and stereo scenes whose views are known.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.evaluation.datasets import find_scenes
    from iibr_core.evaluation.evaluate_scene import QUALITIES, Options, evaluate
    from iibr_core.evaluation.evaluation_report import write_report
    from iibr_core.evaluation.metrics import flip, psnr
    from iibr_core.evaluation.report_folder import require_report_folder
    from iibr_core.evaluation.tables import summary_line
    from iibr_core.evaluation.trials import DisparityFrom
else:
    __getattr__ = offered_by(__file__)
