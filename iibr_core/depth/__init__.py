"""Where a photo's disparity comes from.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.depth.choice import BETTER_WAYS, DepthChoice, DepthOrigin, DepthStart
else:
    __getattr__ = offered_by(__file__)
