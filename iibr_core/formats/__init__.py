"""Files in and out: one module for each format.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.formats.files import (
        file_within,
        is_file,
        is_folder,
        ordinary_file,
        printable,
        read_text,
        shown_name,
        status_of,
    )
    from iibr_core.formats.images.header import read_photo_header
    from iibr_core.formats.images.metadata import PictureMetadata, camera_facts, read_metadata
    from iibr_core.formats.images.oiio_reader import read_raster, read_size
    from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS, MADE_SMALLER, read_photo, write_image
    from iibr_core.formats.images.picture_kinds import (
        AS_USUAL,
        BEST_QUALITY,
        KINDS,
        PROFILES,
        PictureFormat,
        is_float,
        require_picture_format,
    )
    from iibr_core.formats.images.picture_writers import write_picture
    from iibr_core.formats.images.settings_text import ATTRIBUTE, settings_text_in
    from iibr_core.formats.images.thumbnail import read_thumbnail
    from iibr_core.formats.light_fields.light_field_formats import (
        WRITERS,
        LightFieldWriter,
        WriterFactory,
        find_light_field,
        is_light_field,
        open_light_field,
        writer_for,
    )
    from iibr_core.formats.light_fields.multi_view_scene import common_size
    from iibr_core.formats.light_fields.views import grid_of, read_stored_view
    from iibr_core.formats.maps.reader import read_map
    from iibr_core.formats.maps.writer import write_map
    from iibr_core.formats.outputs import (
        AlreadyThereError,
        UnfinishedFolder,
        atomic_write,
        make_folder,
        release_place,
        require_file_place,
        require_files_in,
        require_folder_place,
        require_own_folder,
    )
    from iibr_core.formats.poses import central_camera, read_poses
    from iibr_core.formats.quilts import DEVICES
    from iibr_core.formats.unfinished import CLAIMS
else:
    __getattr__ = offered_by(__file__)
