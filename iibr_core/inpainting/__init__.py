"""Content for what the photo never saw.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.inpainting.background import fill_background
    from iibr_core.inpainting.inpainter import Inpainter
    from iibr_core.inpainting.registry import DEFAULT_INPAINTER, INPAINTER_FORMS, load_inpainter, require_inpainter
else:
    __getattr__ = offered_by(__file__)
