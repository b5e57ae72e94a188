"""Facts that other programs find in exported files: sizes, tags, colours, numbers, as values that JSON holds."""

import base64
import configparser
import json
import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pillow_heif
import trimesh
from numpy.typing import NDArray
from PIL import Image, ImageCms, ImageSequence
from plyfile import PlyData

from iibr_core.formats.maps.pfm import read_pfm
from tests.iibr_core.exports.readers import decoded_levels, read_spz, rgb_from, stream_in
from tests.iibr_core.facts import colors, spread

EXIF, GPS = 0x8769, 0x8825


def facts_of(path: Path) -> dict[str, Any]:
    """Return the facts of a file or folder by their names."""
    if path.is_dir():
        inside = sorted(each for each in path.rglob("*") if each.is_file())
        read = {each.relative_to(path).as_posix(): _of_file(each) for each in inside if each.suffix in READERS}
        return {"name": path.name, "files": [each.relative_to(path).as_posix() for each in inside], **read}
    return {"name": path.name, **_of_file(path)}


def _of_file(path: Path) -> dict[str, Any]:
    return READERS[path.suffix](path)


def _picture(path: Path) -> dict[str, Any]:
    if path.suffix == ".heic":
        return _pair(path)
    with Image.open(path) as image:
        if getattr(image, "n_frames", 1) > 1:
            return _animation(image)
        exif, icc, xmp = image.getexif(), image.info.get("icc_profile"), image.info.get("xmp", b"")
        found: dict[str, Any] = {"size": list(image.size), "mode": image.mode, **_tags(exif)}
        found["profile"] = icc and ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(BytesIO(icc))).strip()
        found["title"] = re.findall(r"<rdf:li[^>]*>([^<]*)", xmp if isinstance(xmp, str) else xmp.decode())
        found["bits"] = str(oiio.ImageBuf(str(path)).spec().format) if path.suffix != ".avif" else "uint8"
        found["description"] = image.info.get("Description") or image.info.get("ImageDescription")
        if image.mode == "F":
            return found | _values(np.asarray(image))
        if image.mode == "I;16":
            return found | {"values": spread(np.asarray(image)), "colors": colors(np.asarray(image) // 257)}
        if path.suffix in (".tif", ".png") and found["bits"] == "uint16":
            stored = oiio.ImageBuf(str(path)).get_pixels(oiio.UINT16)
            return found | {"values": spread(stored), "colors": colors(stored // 257)}
        return found | {"colors": colors(np.asarray(image.convert("RGB")))}


def _tags(exif: Image.Exif) -> dict[str, Any]:
    kept = {str(tag): exif[tag] for tag in (0x010E, 0x0112, 0x013B, 0x8298) if tag in exif}
    camera = {str(tag): value for tag, value in exif.get_ifd(EXIF).items() if tag in (0xA001, 0xA002, 0xA003, 0xA405)}
    return {"exif": kept | camera, "position": bool(exif.get_ifd(GPS))}


def _animation(image: Image.Image) -> dict[str, Any]:
    frames = [(each.copy(), np.asarray(each.convert("RGB"))) for each in ImageSequence.Iterator(image)]
    durations, pictures = zip(*((frame.info["duration"], picture) for frame, picture in frames))
    return {
        "size": list(image.size), "loop": image.info["loop"], "durations": list(durations),
        "frames": [colors(picture) for picture in pictures],
    }  # fmt: skip


def _pair(path: Path) -> dict[str, Any]:
    file = pillow_heif.open_heif(path)
    exif = Image.Exif()
    exif.load(file[0].info.get("exif") or b"")
    return {"size": list(file.size), **_tags(exif), "eyes": [colors(np.asarray(picture)) for picture in file]}


def _video(path: Path) -> dict[str, Any]:
    import av

    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        pictures = [frame.reformat(format="rgb24", src_colorspace="ITU709") for frame in container.decode(stream)]
        context = stream.codec_context
        codes = [context.color_primaries, context.color_trc, context.colorspace, context.color_range]
        return {
            "codec": context.name, "rate": float(stream.average_rate), "seconds": container.duration / 1e6,
            "size": [context.width, context.height], "codes": codes, "pixels": context.pix_fmt,
            "frames": [colors(picture.to_ndarray()) for picture in pictures],
        }  # fmt: skip


def _values(values: NDArray[Any]) -> dict[str, Any]:
    return {"shape": list(values.shape), "type": values.dtype.name, "values": spread(values)}


def _exr(path: Path) -> dict[str, Any]:
    image = oiio.ImageBuf(str(path))
    pixels = np.asarray(image.get_pixels(oiio.FLOAT))
    about = {
        "channels": list(image.spec().channelnames),
        "description": image.spec().get_string_attribute("ImageDescription"),
    }
    return about | _values(pixels) | {"corners": spread(np.concatenate([pixels[0], pixels[:, -1]]))}


def _table(path: Path) -> dict[str, Any]:
    vertex = PlyData.read(str(path))["vertex"]
    return {"count": len(vertex), **{each.name: spread(vertex[each.name]) for each in vertex.properties}}


def _splats(path: Path) -> dict[str, Any]:
    read = read_spz(path)
    parts = {name: values if values.ndim > 1 else values[:, None] for name, values in read.items()}
    return {"count": len(read["radii"]), **{name: [spread(c) for c in part.T] for name, part in parts.items()}}


def _meshes(path: Path) -> dict[str, Any]:
    scene = trimesh.load_scene(path, process=False)
    found = []
    for mesh in scene.dump():
        texture = mesh.visual.material.baseColorTexture.convert("RGB")
        places = [spread(axis) for axis in (*mesh.vertices.T, *mesh.visual.uv.T)]
        found.append({"places": places, "area": float(f"{mesh.area:.5g}"), "size": list(texture.size),
                      "colors": colors(np.asarray(texture))})  # fmt: skip
    lens = json.loads(path.read_bytes()[20:].partition(b"BIN\0")[0].rpartition(b"}")[0] + b"}")["cameras"][0]
    return {"fov": [float(angle) for angle in scene.camera.fov], "lens": lens["perspective"], "meshes": found}


def _page(path: Path) -> dict[str, Any]:
    text = path.read_text("utf-8")
    field = json.loads(text.partition('id="field">')[2].partition("</script>")[0])
    height, width = field["height"], field["width"]
    luma, chroma = (decoded_levels(stream_in(text, field, name)) for name in ("luma", "chroma"))
    views = [rgb_from(y[:height, :width], c[: 2 * height, :width]) for y, c in zip(luma, chroma, strict=True)]
    levels = [each[:height, :width] for each in decoded_levels(stream_in(text, field, "disparity"))]
    found = {name: value for name, value in field.items() if name not in ("numbers", "chunks")}
    found["words"] = re.findall(r"<title>.*?</title>|<meta name=\"[^v].*?>|alt=\".*?\"|<h1>.*?</h1>|<p>.*?</p>", text)
    with Image.open(BytesIO(base64.b64decode(re.search('avif;base64,([^"]*)', text)[1]))) as first:
        found["first"] = colors(np.asarray(first.convert("RGB")))
    ends = [0, len(field["order"]) - 1, len(views) - 1]
    return found | {"views": [colors(views[k]) for k in ends], "levels": [spread(levels[k]) for k in ends]}


def _cameras(path: Path) -> dict[str, Any]:
    stated = json.loads(path.read_text())
    frames = [
        [each["file_path"], each["cx"], each["cy"], *np.ravel(each["transform_matrix"])] for each in stated["frames"]
    ]
    return {name: value for name, value in stated.items() if name != "frames"} | {"frames": frames}


def _lines(path: Path) -> dict[str, Any]:
    lines = path.read_text().splitlines()
    words = [[_number(word) for word in line.split()] for line in lines[:: max(len(lines) // 12, 1)]]
    return {"lines": len(lines), "some": words}


def _number(word: str) -> float | str:
    return float(word) if re.fullmatch(r"-?[\d.]+(e-?\d+)?", word) else word


def _parameters(path: Path) -> dict[str, Any]:
    parser = configparser.ConfigParser()
    parser.read(path)
    return {name: _number(text) for section in parser.sections() for name, text in parser.items(section)}


def _arrays(path: Path) -> dict[str, Any]:
    with np.load(path) as stored:
        ends = {name: [spread(stored[name][0, 0]), spread(stored[name][-1, -1])] for name in stored.files}
        return {name: [*_values(stored[name]).values(), *ends[name]] for name in stored.files}


def _array(path: Path) -> dict[str, Any]:
    values = np.load(path)
    return _values(values) | {"rows": [spread(row) for row in values[:: max(len(values) // 6, 1)]]}


READERS: dict[str, Callable[[Path], dict[str, Any]]] = {
    **dict.fromkeys((".png", ".jpg", ".webp", ".avif", ".tif", ".gif", ".heic"), _picture),
    **dict.fromkeys((".mp4", ".webm"), _video), ".exr": _exr, ".npy": _array, ".npz": _arrays, ".ply": _table,
    ".spz": _splats, ".glb": _meshes, ".html": _page, ".json": _cameras, ".txt": _lines, ".cfg": _parameters,
    ".pfm": lambda path: _values(read_pfm(path)) | {"rows": [spread(row) for row in read_pfm(path)[::7]]},
}  # fmt: skip
