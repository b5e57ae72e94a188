"""What a scene can be exported as: one file a kind, one line each in `kinds.py`.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.exports.animation import read_keys
    from iibr_core.exports.export_opening import OpenDrawn, OpticsOf, open_for_export
    from iibr_core.exports.framing import centred, size_in_frame
    from iibr_core.exports.full_picture import FullPicture, encode_light, is_full, require_full
    from iibr_core.exports.kinds import EXPORTS, PURPOSES, ExportKind, Purpose, export_kind, require_ending
    from iibr_core.exports.loops import LOOPS, LoopKind, point_on_loop
    from iibr_core.exports.options import ANIMATIONS, USUAL_OPTIONS, AnimationKind, ExportOptions
    from iibr_core.exports.photo_folder import FolderOrder, FolderPhoto, first_photo, in_order, list_photos
    from iibr_core.exports.render_settings import LensTile, RenderSettings, require_size
    from iibr_core.exports.settings import (
        MOST_FRAMES,
        RATE_LIMITS,
        USUAL_SECONDS,
        ExportSettings,
        resolve_settings,
        size_of_width,
    )
    from iibr_core.exports.source import ExportSource
    from iibr_core.exports.writers import export_path, optics_of, require_export_place, writer_of
else:
    __getattr__ = offered_by(__file__)
