"""AVIF photos, by Pillow; OpenImageIO's wheel reads none. They come out as rasters like all others."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio

from iibr_core.formats.files import MAX_FILE_PIXELS, open_binary, reason_of, refuse_bomb, require_file
from iibr_core.formats.images.heic import DECODE_ERRORS, describe
from iibr_core.formats.images.oiio_reader import Raster
from iibr_core.types import ImageSize, InputError

BRANDS = frozenset({b"avif", b"avis"})
MOST_BRANDS_BYTES = 256
ORIENTATION_TAG = 0x0112


def is_avif(path: Path) -> bool:
    """Whether a file begins as AVIF files do, whatever its name. Raises InputError where it cannot be read."""
    with open_binary(path) as file:
        start = file.read(MOST_BRANDS_BYTES)
    size = int.from_bytes(start[:4], "big")
    return start[4:8] == b"ftyp" and not BRANDS.isdisjoint(start[k : k + 4] for k in range(8, min(size, len(start)), 4))


def read_avif(path: Path) -> Raster:
    """Decode an AVIF's photo, in 8 bits, as it is stored. Raises InputError as `read_raster` does."""
    with _open(path) as image:
        has_alpha = image.mode in ("RGBA", "LA", "PA")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # Pillow's bomb limit is lower than ours
                pixels = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
        except DECODE_ERRORS as error:
            raise InputError(f"{path}: damaged or cut off ({reason_of(error)}); get the whole file again") from error
        spec = oiio.ImageSpec(image.width, image.height, 3, "uint8")
        describe(spec, image.info)
        orientation = image.getexif().get(ORIENTATION_TAG, 1)
        spec.attribute("Orientation", orientation if orientation in range(1, 9) else 1)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    alpha = np.ascontiguousarray(pixels[..., 3]) if has_alpha else None
    is_opaque = alpha is None or bool((alpha == np.iinfo(alpha.dtype).max).all())
    return Raster(pixels[..., :3], None if is_opaque else alpha, spec)


def avif_size(path: Path) -> ImageSize:
    """As stored, from an AVIF's header. Raises InputError as `read_avif` does."""
    with _open(path) as image:
        return ImageSize(image.height, image.width)


def _open(path: Path) -> Any:
    from PIL import Image

    require_file(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = Image.open(path, formats=("AVIF",))
    except (*DECODE_ERRORS, Image.DecompressionBombError) as error:
        raise InputError(f"{path}: cannot be read as an AVIF picture ({reason_of(error)})") from error
    if min(image.size) < 1 or image.width * image.height > MAX_FILE_PIXELS:
        image.close()
        raise InputError(f"{path}: {image.width}x{image.height} exceed {MAX_FILE_PIXELS:,} pixels; make it smaller")
    refuse_bomb(path, image.width * image.height * 4)
    return image
