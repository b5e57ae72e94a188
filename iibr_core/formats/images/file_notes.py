"""Notes for people about stereo pairs, panoramas and animations, of which one flat picture is shown."""

from pathlib import Path

from iibr_core.formats.images.open_picture import read_metadata
from iibr_core.formats.images.side_by_side import stated_pair
from iibr_core.formats.images.xmp import parse_packet, value_in
from iibr_core.types import InputError

GPANO = "http://ns.google.com/photos/1.0/panorama/"
GIMAGE = "http://ns.google.com/photos/1.0/image/"
GDEPTH = "http://ns.google.com/photos/1.0/depthmap/"


def file_notes(path: Path) -> tuple[str, ...]:
    """Return a sentence for each thing in a photo's file that is shown in part, or not as it was meant.

    A damaged header gives no notes.
    """
    _, note = stated_pair(path)
    metadata = read_metadata(path)
    animation = f"Animation: the first of its {metadata.pictures} pictures is used." if metadata.pictures > 1 else ""
    return (*filter(None, [note]), *_panorama_notes(metadata.xmp), *filter(None, [animation]))


def _panorama_notes(xmp: bytes) -> tuple[str, ...]:
    """Return notes from XMP as Google's cameras write it for panoramas and photos with a right eye's picture."""
    if GPANO.encode() not in xmp and GIMAGE.encode() not in xmp:
        return ()
    try:
        tree = parse_packet(xmp)
    except InputError:
        return ()
    notes: tuple[str, ...] = ()
    projection = value_in(tree, GPANO, "ProjectionType")
    if projection is not None or value_in(tree, GPANO, "FullPanoWidthPixels") is not None:
        kind = f" ({projection.strip()})" if projection and projection.strip().isalpha() else ""
        notes += (f"Panorama{kind}: shown flat, as if it were an ordinary photo, so straight lines look bent.",)
    # Photos with a depth map hold the picture before it was blurred.
    if value_in(tree, GIMAGE, "Mime") is not None and GDEPTH.encode() not in xmp:
        notes += ("The right eye's picture in it (Cardboard Camera, VR180) is not used.",)
    return notes
