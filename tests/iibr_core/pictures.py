"""Pictures as other programs write them: each container, with what its kind may state."""

from io import BytesIO
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pillow_heif
from PIL import Image
from PIL.PngImagePlugin import PngInfo


def write_oiio(path: Path, pixels: np.ndarray, kind: str | None = None, tile: int = 0, **attributes: object) -> Path:
    """Write (H, W) or (H, W, C) by OpenImageIO, as what their numbers are or as a kind of its names.

    tile: side of tiles in pixels, 0 for rows. attributes: `__` stands for a colon; several numbers are a list.
    """
    pixels = np.atleast_3d(pixels)
    kind = kind or pixels.dtype.name.replace("float32", "float")
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.tile_width = spec.tile_height = tile
    for name, value in attributes.items():
        if isinstance(value, tuple):
            spec.attribute(name, f"int[{len(value)}]", value)
        else:
            spec.attribute(name.replace("__", ":"), value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels))
    output.close()
    return path


def as_bytes(picture: Image.Image, kind: str, **options: object) -> bytes:
    """Return the file of a picture. kind: one of Pillow's, or HEIC."""
    stored = BytesIO()
    if kind == "HEIC":
        pillow_heif.from_pillow(picture).save(stored, **options)
    else:
        picture.save(stored, kind, **options)
    return stored.getvalue()


def with_xmp(picture: Image.Image, kind: str, packet: bytes) -> bytes:
    """Return the file of a picture that holds an XMP packet."""
    if kind == "PNG":
        info = PngInfo()
        info.add_itxt("XML:com.adobe.xmp", packet.decode())
        return as_bytes(picture, kind, pnginfo=info)
    return as_bytes(picture, kind, **({"tiffinfo": {700: packet}} if kind == "TIFF" else {"xmp": packet}))
