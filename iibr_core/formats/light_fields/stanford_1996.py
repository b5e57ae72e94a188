"""The Stanford light fields of 1996 (Levoy and Hanrahan): `name.u.v.rgb`, pictures of a slab's camera plane.

u counts to the right there and v upwards. Pictures of one slab look at one plane, which does not move.
"""

from __future__ import annotations

import re
from pathlib import Path

from iibr_core.formats.files import entries_of, shown_name
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView, on_grid
from iibr_core.types import InputError, ViewOffset

NAME = re.compile(r"(.+)\.(\d{1,3})\.(\d{1,3})\.(?:rgb|sgi|ppm|png)$", re.IGNORECASE)


def read_stanford_1996(folder: Path) -> MultiView | None:
    """The views of a folder, None where they are named otherwise. Raises InputError for those of several slabs, or
    with gaps.
    """
    named = [(path, match) for path in entries_of(folder) if (match := NAME.match(path.name))]
    if len(named) < 2:
        return None
    if len(slabs := {match[1] for _, match in named}) > 1:
        raise InputError(
            f"{folder}: holds views of {len(slabs)} slabs ({', '.join(sorted(slabs)[:3])}); keep one of them"
        )
    numbers = [(-int(match[3]), int(match[2])) for _, match in named]
    views = tuple(
        KnownView(path.name, ViewOffset(float(v), float(u)), PictureSource(path))
        for (path, _), (v, u) in zip(named, numbers)
    )
    name = shown_name(folder.resolve().name)
    return on_grid(MultiView(name, f"Stanford 1996, {len(views)} views", views), numbers)
