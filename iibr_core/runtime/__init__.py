"""What the hot loops run on: compilation, row bands that hear a stop, files that come along.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.runtime.allocator import give_back_memory, limit_arenas
    from iibr_core.runtime.compiling import COMPILING, tell_compiling
    from iibr_core.runtime.extras import is_installed, require_extra
    from iibr_core.runtime.machine import core_count
    from iibr_core.runtime.resources import resource_folder
    from iibr_core.runtime.shader_sources import FlatSource, ShaderError, flatten
    from iibr_core.runtime.tiling import Cancelled, ShouldStop, never, raise_if_stopped
    from iibr_core.runtime.time_left import TimeLeft, about_left
else:
    __getattr__ = offered_by(__file__)
