"""Textured meshes as GLB: a glTF 2.0 file in one piece (Khronos)."""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage

ALIGNMENT = 4
"""Number of bytes that chunks and arrays are padded to a multiple of."""
FLOAT, UINT32 = 5126, 5125
VERTICES, INDICES = 34962, 34963
LINEAR, LINEAR_IN_MIPMAPS, CLAMP = 9729, 9987, 33071
NEAR_PLANES = 100
"""Number of distances from the camera to its near plane that make one length unit."""
UNLIT = "KHR_materials_unlit"


@dataclass(frozen=True, eq=False)
class TexturedMesh:
    """A mesh and its texture. places: (N, 3), y up and z backwards. uv: (N, 2), from the texture's upper left corner.

    indices: (M, 3). texture: a JPEG file, sRGB.
    """

    places: FloatImage
    uv: FloatImage
    indices: NDArray[np.uint32]
    texture: bytes


def write_glb(path: Path, meshes: Sequence[TexturedMesh], unit: float, vertical_angle: float, aspect: float) -> None:
    """Write meshes, visible from both sides and without light, and a camera at the origin that looks along -z.

    unit: metres of one length unit. vertical_angle: the camera's field of view in radians. aspect: width / height.
    """
    lens = {"yfov": vertical_angle, "aspectRatio": aspect, "znear": unit / NEAR_PLANES}
    blobs: list[bytes] = []
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "iibr"},
        "extensionsUsed": [UNLIT],
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "name": "photo", "scale": [unit] * 3}, {"camera": 0, "name": "camera"}],
        "cameras": [{"type": "perspective", "perspective": lens}],
        "meshes": [{"primitives": []}],
        "samplers": [{"magFilter": LINEAR, "minFilter": LINEAR_IN_MIPMAPS, "wrapS": CLAMP, "wrapT": CLAMP}],
        **{name: [] for name in ("materials", "textures", "images", "accessors", "bufferViews")},
    }
    for number, mesh in enumerate(meshes):
        _add_mesh(document, blobs, number, mesh)
    binary = b"".join(blobs)
    document["buffers"] = [{"byteLength": len(binary)}]
    text = _padded(json.dumps(document, separators=(",", ":")).encode("ascii"), b" ")
    chunks = struct.pack("<I4s", len(text), b"JSON"), text, struct.pack("<I4s", len(binary), b"BIN\0"), binary
    with write_file(path) as temporary:
        temporary.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + sum(map(len, chunks))) + b"".join(chunks))


def _add_mesh(document: dict[str, Any], blobs: list[bytes], number: int, mesh: TexturedMesh) -> None:
    """Add one mesh with its material, numbered as the mesh, to a document and its binary part."""
    places, uv, indices = (_add_array(document, blobs, array) for array in (mesh.places, mesh.uv, mesh.indices))
    primitive = {"attributes": {"POSITION": places, "TEXCOORD_0": uv}, "indices": indices, "material": number}
    document["meshes"][0]["primitives"].append(primitive)
    look = {"baseColorTexture": {"index": number}, "metallicFactor": 0, "roughnessFactor": 1}
    document["materials"].append({"pbrMetallicRoughness": look, "doubleSided": True, "extensions": {UNLIT: {}}})
    document["textures"].append({"source": number, "sampler": 0})
    document["images"].append({"mimeType": "image/jpeg", "bufferView": _add_bytes(document, blobs, mesh.texture)})


def _add_array(document: dict[str, Any], blobs: list[bytes], array: NDArray[Any]) -> int:
    """Add vectors (N, 2 or 3) of floats, or triangles (N, 3); return the number of their accessor."""
    is_floats = array.dtype == np.float32
    view = _add_bytes(document, blobs, array.astype(array.dtype.newbyteorder("<")).tobytes())
    document["bufferViews"][view]["target"] = VERTICES if is_floats else INDICES
    rows = array if is_floats else array.reshape(-1, 1)
    document["accessors"].append({
        "bufferView": view,
        "componentType": FLOAT if is_floats else UINT32,
        "type": f"VEC{array.shape[1]}" if is_floats else "SCALAR",
        "count": len(rows),
        "min": rows.min(axis=0).tolist(),
        "max": rows.max(axis=0).tolist(),
    })  # fmt: skip
    return len(document["accessors"]) - 1


def _add_bytes(document: dict[str, Any], blobs: list[bytes], content: bytes) -> int:
    """Add bytes to the binary part; return the number of their view."""
    start = sum(map(len, blobs))
    document["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": len(content)})
    blobs.append(_padded(content, b"\0"))
    return len(document["bufferViews"]) - 1


def _padded(content: bytes, filler: bytes) -> bytes:
    return content + filler * (-len(content) % ALIGNMENT)
