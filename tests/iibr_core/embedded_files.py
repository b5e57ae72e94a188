"""Writes small photos that carry depth, in each container that the parsers read: what the tests know, they wrote."""

import base64
import hashlib
import io
import json
import struct

import numpy as np
from PIL import Image

STANDARD, EXTENDED = b"http://ns.adobe.com/xap/1.0/\0", b"http://ns.adobe.com/xmp/extension/\0"
RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"


def picture(pixels: np.ndarray, kind: str = "JPEG", orientation: int = 1) -> bytes:
    """A PNG's or JPEG's bytes of (H, W) or (H, W, 3) uint8, or (H, W) uint16."""
    exif = Image.Exif()
    exif[0x0112] = orientation
    file = io.BytesIO()
    options = {"quality": 95, "subsampling": 0} if kind == "JPEG" else {}
    Image.fromarray(pixels).save(file, kind, **({"exif": exif} if orientation != 1 else {}), **options)
    return file.getvalue()


def grey_photo(size: tuple[int, int]) -> bytes:
    return picture(np.full((*size, 3), 128, np.uint8))


def with_segments(jpeg: bytes, contents: list[bytes]) -> bytes:
    """APP1 segments right behind the start of the picture."""
    segments = b"".join(b"\xff\xe1" + struct.pack(">H", len(content) + 2) + content for content in contents)
    return jpeg[:2] + segments + jpeg[2:]


def packet(attributes: dict[str, str], children: str = "", prolog: str = "") -> bytes:
    """An XMP packet whose names are "namespace name"."""
    namespaces = sorted({name.split()[0] for name in attributes})
    declared = "".join(f' xmlns:n{i}="{namespace}"' for i, namespace in enumerate(namespaces))
    written = "".join(
        f' n{namespaces.index(name.split()[0])}:{name.split()[1]}="{value}"' for name, value in attributes.items()
    )
    return (
        f'{prolog}<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="{RDF}"><rdf:Description rdf:about=""'
        f"{declared}{written}>{children}</rdf:Description></rdf:RDF></x:xmpmeta>"
    ).encode()


def extended_parts(extended: bytes, part_bytes: int) -> tuple[str, list[bytes]]:
    """The GUID of an extended packet, and the contents of the segments that hold its parts."""
    guid = hashlib.md5(extended).hexdigest().upper()
    head, starts = EXTENDED + guid.encode(), range(0, len(extended), part_bytes)
    return guid, [head + struct.pack(">II", len(extended), at) + extended[at : at + part_bytes] for at in starts]


GDEPTH, GIMAGE = "http://ns.google.com/photos/1.0/depthmap/", "http://ns.google.com/photos/1.0/image/"
NOTE = "http://ns.adobe.com/xmp/note/"


def gdepth_segments(
    depth, *, near=2.0, far=10.0, kind="RangeInverse", confidence=None, sharp=None, units="", part_bytes=None
):
    """APP1 contents of GDepth: all in one packet, or the data in an extended packet cut into parts."""
    about = {f"{GDEPTH} Format": kind, f"{GDEPTH} Near": str(near), f"{GDEPTH} Far": str(far)}
    if units:
        about[f"{GDEPTH} Units"] = units
    data = {f"{GDEPTH} Data": base64.b64encode(depth).decode()}
    if confidence is not None:
        data[f"{GDEPTH} Confidence"] = base64.b64encode(confidence).decode()
    if sharp is not None:
        data[f"{GIMAGE} Data"] = base64.b64encode(sharp).decode()
    if part_bytes is None:
        return [STANDARD + packet(about | data)]
    guid, parts = extended_parts(packet(data), part_bytes)
    return [STANDARD + packet(about | {f"{NOTE} HasExtendedXMP": guid}), *parts]


ORIGINAL = "android/original_image"


def dynamic_depth_jpeg(photo, depth, *, before=b"", between=b"", behind=b"", original=b"", shared_container=False):
    """Return a Dynamic Depth 1.0 photo. original: the picture before it was blurred.

    before: an item that precedes the depth map. between: a trailer between photo and items. behind: one behind all.
    """
    root = "http://ns.google.com/photos/"
    container = "1.0/container/" if shared_container else "dd/1.0/container/"
    item = "1.0/container/item/" if shared_container else "dd/1.0/item/"
    entries = [("image/jpeg", "Primary", len(photo) if shared_container else 0, "primary")]
    entries += [("image/jpeg", "GainMap", len(before), "gain")] if before else []
    if original:  # phones of today state a meaning, the specification of 2019 a name
        entries += [
            ("image/jpeg", *(("Original", len(original), "") if shared_container else ("", len(original), ORIGINAL)))
        ]
    entries += [("image/png", "Depth", len(depth), "android/depthmap")]
    listed = "".join(
        f'<rdf:li rdf:parseType="Resource"><C:Item I:Mime="{mime}" I:Semantic="{semantic}" I:Length="{size}"'
        f' I:DataURI="{uri}"/></rdf:li>'
        for mime, semantic, size, uri in entries
    )
    xmp = packet(
        {f"{root}dd/1.0/device/ Name": "test"},
        f'<C:Directory xmlns:C="{root}{container}" xmlns:I="{root}{item}"><rdf:Seq>{listed}</rdf:Seq></C:Directory>'
        f'<D:Cameras xmlns:D="{root}dd/1.0/device/" xmlns:K="{root}dd/1.0/camera/" xmlns:M="{root}dd/1.0/depthmap/">'
        f'<rdf:Seq><rdf:li rdf:parseType="Resource"><D:Camera><K:DepthMap rdf:parseType="Resource">'
        "<M:Format>RangeInverse</M:Format><M:Near>2.0</M:Near><M:Far>10.0</M:Far><M:Units>Meters</M:Units>"
        "<M:DepthURI>android/depthmap</M:DepthURI></K:DepthMap></D:Camera></rdf:li></rdf:Seq></D:Cameras>",
    )
    return with_segments(photo, [STANDARD + xmp]) + between + before + original + depth + behind


def apple_jpeg(photo: bytes, depth: np.ndarray, low: object, high: object, kind: str = "disparity") -> bytes:
    """A portrait as iPhones save it as JPEG: depth in a second JPEG behind the photo."""
    space = "http://ns.apple.com/pixeldatainfo/1.0/"
    values = {"AuxiliaryImageType": kind, "FloatMinValue": str(low), "FloatMaxValue": str(high)}
    about = {f"{space} {name}": value for name, value in values.items()}
    return photo + with_segments(picture(depth), [STANDARD + packet(about)])


def samsung_jpeg(photo: bytes, depth: np.ndarray, audio: bool = False, sharp: bytes = b"") -> bytes:
    """Return a "Live focus" photo with Samsung's trailer; depth (H, W) uint8, dark is near."""
    extra = bytes(32) + b"\x03\0\xff\xff" + struct.pack("<II", *depth.shape[::-1]) + bytes(64)
    blocks = [
        (0x0A01, b"Image_UTC_Data", b"1234567890123"),
        (0x0AB1, b"DualShot_DepthMap_1", depth.tobytes()),
        (0x0AB3, b"DualShot_Extra_Info", extra),
        *([(0x0AB0, b"DualShot_1", sharp)] if sharp else []),
    ]
    body, places = b"", []
    for kind, name, content in blocks:
        block = struct.pack("<HHI", 0, kind, len(name)) + name + content
        places.append((kind, len(body), len(block)))
        body += block
    directory = b"SEFH" + struct.pack("<II", 101, len(places))
    for kind, start, length in places:
        directory += struct.pack("<HHII", 0, kind, len(body) - start, length)
    trailer = body + directory + struct.pack("<I", len(directory)) + b"SEFT"
    if audio:
        trailer += b"QDIO" + bytes(16) + struct.pack("<I", 20) + b"QDIOBS"
    return photo + trailer


HEIC_DEPTH = b"urn:mpeg:hevc:2015:auxid:2"


def heic(pixels, depth=None, auxiliary=HEIC_DEPTH, orientation=1):
    """A HEIC photo, with an auxiliary picture if asked: the second picture of a file of two, made one by hand.

    auxiliary: its type, depth or another one. orientation: Exif's, of the stored pixels.
    """
    import pillow_heif

    file = pillow_heif.from_bytes("RGB", (pixels.shape[1], pixels.shape[0]), pixels.tobytes())
    if depth is not None:
        file.add_frombytes("L", (depth.shape[1], depth.shape[0]), depth.tobytes())
    whole, exif = io.BytesIO(), Image.Exif()
    exif[0x0112] = orientation
    file.save(whole, format="HEIF", quality=-1, **({"exif": exif.tobytes()} if orientation != 1 else {}))
    return whole.getvalue() if depth is None else _with_second_as(bytearray(whole.getvalue()), auxiliary)


def _with_second_as(data: bytearray, auxiliary_type: bytes) -> bytes:
    """Adds a reference "auxl" from item 2 to item 1, and the property that says what it is."""
    auxiliary = _box(b"auxC", bytes(4) + auxiliary_type + b"\0")
    reference = _box(b"iref", bytes(4) + _box(b"auxl", struct.pack(">HHH", 2, 1, 1)))
    at = {name: data.index(name) - 4 for name in (b"meta", b"iloc", b"iprp", b"ipco", b"ipma")}
    size = {name: int.from_bytes(data[start : start + 4], "big") for name, start in at.items()}
    properties, place = 0, at[b"ipco"] + 8
    while place < at[b"ipco"] + size[b"ipco"]:
        properties += 1
        place += int.from_bytes(data[place : place + 4], "big")
    # From the end to the start, so that places stay right: the association of item 2 is the last of "ipma".
    count_at = at[b"ipma"] + 16 + 3 + data[at[b"ipma"] + 18] + 2
    ipma_end = at[b"ipma"] + size[b"ipma"]
    data[count_at] += 1
    data[ipma_end:ipma_end] = bytes([0x80 | (properties + 1)])
    data[place:place] = auxiliary
    data[at[b"iprp"] : at[b"iprp"]] = reference
    added = 1 + len(auxiliary) + len(reference)
    grown = {b"ipma": 1, b"ipco": len(auxiliary), b"iprp": 1 + len(auxiliary), b"meta": added}
    for name, more in grown.items():
        start = data.index(name) - 4
        data[start : start + 4] = struct.pack(">I", size[name] + more)
    for item in range(2):
        base = at[b"iloc"] + 16 + item * 18 + 4
        data[base : base + 4] = struct.pack(">I", int.from_bytes(data[base : base + 4], "big") + added)
    return bytes(data)


def _box(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content) + 8) + name + content


def disc_scene() -> tuple[np.ndarray, np.ndarray]:
    """A coloured photo (96, 128, 3) of a disc before a wall, and its map (96, 128), white near."""
    y, x = np.mgrid[:96, :128]
    disc = np.hypot(x - 60, y - 60) < 30
    pixels = np.array([90, 120, 60]) + np.random.default_rng(0).integers(0, 60, (96, 128, 3))
    pixels[disc] = [250, 130, 90]
    return pixels.astype(np.uint8), np.where(disc, 230, 20 + y // 2).astype(np.uint8)


def huawei_jpeg(photo: bytes, stored: np.ndarray, orientation: int = 0, sharp: bytes = b"") -> bytes:
    """A "wide aperture" photo: the shown and the sharp picture, then the map (h, w) uint8 as it is stored."""
    header = bytearray(68)
    header[7] = orientation
    header[16:20] = struct.pack("<HH", stored.shape[1], stored.shape[0])
    return photo + (sharp or photo) + b"\x56\xe9edof" + bytes(header) + stored.tobytes()


def avif(pixels: np.ndarray, depth: np.ndarray, orientation: int = 1) -> bytes:
    """An AVIF photo with an auxiliary depth map of its size: Pillow's alpha, by another name."""
    file, exif = io.BytesIO(), Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(np.dstack([pixels, depth])).save(file, "AVIF", quality=95, exif=exif)
    assert b":auxiliary:alpha\0" in file.getvalue()
    return file.getvalue().replace(b":auxiliary:alpha\0", b":auxiliary:depth\0")


def lytro_file(text: dict[str, object], chunks: dict[str, bytes]) -> bytes:
    sections = [(b"M", "json", json.dumps(text).encode()), *((b"C", name, chunks[name]) for name in chunks)]
    data = b"\x89LFP\r\n\x1a\n" + struct.pack(">II", 1, 0)
    for kind, name, content in sections:
        data += b"\x89LF" + kind + b"\r\n\x1a\n" + struct.pack(">II", 0, len(content)) + name.encode().ljust(80, b"\0")
        data += content + bytes(-len(content) % 16)
    return data


def lytro_stack(pictures: dict[float, bytes], depth: np.ndarray, size: tuple[int, int], is_illum: bool) -> bytes:
    """A processed file: pictures by their lambda, as first cameras or as the Illum list them; depth (h, w) float32."""
    height, width = size
    chunks = {f"sha1-{number}": content for number, content in enumerate(pictures.values())} | {
        "sha1-map": depth.astype("<f4").tobytes()
    }
    listed = [{"imageRef": f"sha1-{k}", "focus" if is_illum else "lambda": at} for k, at in enumerate(pictures)]
    described = {"width": depth.shape[1], "height": depth.shape[0], "imageRef": "sha1-map"}
    if is_illum:
        entry = {"kind": "focusStack", "width": width, "height": height, "depthMap": described, "perImage": listed}
        return lytro_file({"views": [{"accelerations": [entry]}]}, chunks)
    listed = [{"width": width, "height": height, **picture} for picture in listed]
    content = {"depthLut": described, "imageArray": listed}
    return lytro_file({"picture": {"accelerationArray": [{"vendorContent": content}]}}, chunks)
