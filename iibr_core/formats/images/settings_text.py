"""The text of the settings that a picture was saved with, in its header."""

from __future__ import annotations

from pathlib import Path

from iibr_core.types import InputError

ATTRIBUTE = "iibr:settings"


def settings_text_in(path: Path) -> str:
    """The text of the settings in a picture's header, "" without. Raises InputError where it is no picture."""
    import OpenImageIO as oiio

    from iibr_core.formats.files import require_file
    from iibr_core.formats.images.avif import is_avif
    from iibr_core.formats.images.heic import is_heic
    from iibr_core.formats.images.lfp import is_lfp
    from iibr_core.formats.images.metadata import text_in_xmp, unpack_text
    from iibr_core.formats.images.oiio_names import oiio_name
    from iibr_core.formats.images.oiio_reader import complaint_of

    require_file(path)
    if is_heic(path) or is_lfp(path):
        return ""  # this program writes none
    if is_avif(path):
        return text_in_xmp(path, ATTRIBUTE)
    source = oiio.ImageInput.open(oiio_name(path))
    if source is None:
        raise InputError(f"{path}: is no picture ({' '.join(complaint_of(oiio).split())[:120] or 'no reason given'})")
    try:
        if source.format_name() == "webp":
            return text_in_xmp(path, ATTRIBUTE)
        return unpack_text(str(source.spec().get_string_attribute(ATTRIBUTE)), path)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: its settings are damaged (no text); set them by hand") from error
    finally:
        source.close()
