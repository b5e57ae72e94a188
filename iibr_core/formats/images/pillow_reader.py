"""Decodes with Pillow what OpenImageIO's wheel does not read; it comes out as rasters like all others."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import OpenImageIO as oiio

from iibr_core.formats.files import MAX_FILE_PIXELS, reason_of, refuse_bomb
from iibr_core.formats.images.heic import DECODE_ERRORS, describe
from iibr_core.formats.images.oiio_reader import Raster
from iibr_core.types import InputError

if TYPE_CHECKING:
    from PIL.Image import Image

ORIENTATION_TAG = 0x0112


@contextmanager
def open_with_pillow(path: Path, formats: tuple[str, ...], what: str, data: bytes | None = None) -> Iterator[Image]:
    """A picture of one of these formats, its header read. what: it should be, for people. data: of a picture within the
    file, None for the file itself.

    Raises InputError where it is none, or claims an absurd size; also for what goes wrong in the block.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's bomb limit is lower than ours
            image = Image.open(path if data is None else BytesIO(data), formats=formats)
    except (*DECODE_ERRORS, Image.DecompressionBombError) as error:
        raise InputError(f"{path}: cannot be read as {what} ({reason_of(error)})") from error
    with image:
        if min(image.size) < 1 or image.width * image.height > MAX_FILE_PIXELS:
            raise InputError(f"{path}: {image.width}x{image.height} exceed {MAX_FILE_PIXELS:,} pixels; make it smaller")
        refuse_bomb(path, image.width * image.height * 4)
        try:
            yield image
        except DECODE_ERRORS as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"{path}: damaged or cut off ({reason_of(error)}); get the whole file again") from error


def raster_of(image: Image) -> Raster:
    """An opened picture, decoded in 8 bits as it is stored. Raises what Pillow raises for damaged ones."""
    has_alpha = image.mode in ("RGBA", "LA", "PA")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pixels = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    spec = oiio.ImageSpec(image.width, image.height, 3, "uint8")
    describe(spec, image.info)
    orientation = image.getexif().get(ORIENTATION_TAG, 1)
    spec.attribute("Orientation", orientation if orientation in range(1, 9) else 1)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    alpha = np.ascontiguousarray(pixels[..., 3]) if has_alpha else None
    is_opaque = alpha is None or bool((alpha == np.iinfo(alpha.dtype).max).all())
    return Raster(pixels[..., :3], None if is_opaque else alpha, spec)
