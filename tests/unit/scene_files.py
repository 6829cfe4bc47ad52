"""Small valid scene files for the loader tests to read and to break."""

from __future__ import annotations

import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

COMPONENT_TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]], np.float32)
QUAD_UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
QUAD_INDICES = np.array([0, 1, 2, 0, 2, 3], np.uint16)


def png(pixels: Any) -> bytes:
    """An 8-bit RGB picture as PNG."""
    out = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(out, "PNG")
    return out.getvalue()


class Gltf:
    """A glTF document under construction: ``json`` may be edited freely before ``glb`` or ``gltf`` is called."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        self.data = bytearray()

    def view(self, data: bytes, **extra: Any) -> int:
        self.data += bytes(-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **extra}
        self.json["bufferViews"].append(view)
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: Any, **extra: Any) -> int:
        values = np.asarray(values)
        values = values[:, None] if values.ndim == 1 else values
        kind = COMPONENT_TYPES[values.dtype.str[1:]]
        accessor = {"bufferView": self.view(values.tobytes()), "componentType": kind}
        accessor |= {"count": len(values), "type": TYPES[values.shape[1]], **extra}
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def _finished(self) -> dict[str, Any]:
        return {**self.json, "buffers": self.json.get("buffers", [{"byteLength": len(self.data)}])}

    def glb(self) -> bytes:
        text = json.dumps(self._finished()).encode()
        return glb_bytes(text, bytes(self.data))

    def gltf(self) -> bytes:
        document = self._finished()
        document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        return json.dumps(document).encode()


def glb_bytes(text: bytes, data: bytes) -> bytes:
    """A GLB of a JSON text and a binary chunk."""
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def quad_gltf(positions: Any = QUAD, indices: Any = QUAD_INDICES) -> Gltf:
    """One node with a textured quad of 1 m × 2 m in the plane z = 0 that faces +z, and a camera."""
    gltf = Gltf()
    attributes = {
        "POSITION": gltf.accessor(np.asarray(positions)),
        "TEXCOORD_0": gltf.accessor(QUAD_UV),
        "NORMAL": gltf.accessor(np.tile(np.array([0, 0, 1], np.float32), (4, 1))),
    }
    primitive = {"attributes": attributes, "indices": gltf.accessor(np.asarray(indices)), "material": 0}
    picture = gltf.view(png([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [188, 188, 188]]]))
    gltf.json |= {
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "name": "quad"}, {"camera": 0, "name": "eye", "translation": [0.5, 1, 3]}],
        "meshes": [{"primitives": [primitive]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "materials": [
            {
                "name": "paint",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.1234, 0.0019, 0.75, 1],
                    "baseColorTexture": {"index": 0},
                },
                "emissiveFactor": [1, 0.5, 0.25],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}},
                "doubleSided": True,
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}],
        "images": [{"bufferView": picture, "mimeType": "image/png"}],
    }
    return gltf


def written(folder: Path, name: str, data: bytes | str) -> Path:
    """The path of a new file with this content."""
    path = folder / name
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path
