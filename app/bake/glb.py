"""A binary glTF 2.0 file (GLB) under construction: the JSON document and its one binary chunk (glTF 2.0, 4.4)."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAGIC, VERSION, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
COMPONENT_TYPES = {"float32": 5126, "uint16": 5123, "uint32": 5125}
ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
RESTART_INDEX = {"uint16": 0xFFFF}  # the largest index of a type is not allowed (glTF 2.0, 3.7.2.1)


class GlbBuilder:
    """Collects objects by kind (``nodes``, ``materials``...) and binary data; ``to_bytes`` is the file."""

    def __init__(self, generator: str, document: dict[str, Any] | None = None) -> None:
        """document: what there is already, without binary data."""
        self.document: dict[str, Any] = document or {}
        self.document["asset"] = {"version": "2.0", **self.document.get("asset", {}), "generator": generator}
        self._extensions = set(self.document.pop("extensionsUsed", ()))
        self._binary = bytearray()

    def add(self, kind: str, item: dict[str, Any]) -> int:
        """Append to the document's array ``kind``; returns the index."""
        items: list[dict[str, Any]] = self.document.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def add_light(self, item: dict[str, Any]) -> int:
        """A light of KHR_lights_punctual; returns its index."""
        self.use_extension("KHR_lights_punctual")
        lights = self.document.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append(item)
        return len(lights) - 1

    def use_extension(self, name: str) -> None:
        self._extensions.add(name)

    def drop_extension(self, name: str) -> None:
        """Say that an extension is neither used nor required any more."""
        self._extensions.discard(name)
        required = [other for other in self.document.pop("extensionsRequired", ()) if other != name]
        if required:
            self.document["extensionsRequired"] = required

    def add_vertices(self, values: NDArray[np.float32], *, bounds: bool = False) -> int:
        """An accessor of (n, 1 to 4) f32 vertex values, with the bounds that POSITION must state."""
        item = self._accessor(np.ascontiguousarray(values, np.float32), ARRAY_BUFFER)
        if bounds:
            item |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self.add("accessors", item)

    def add_indices(self, indices: NDArray[np.integer[Any]]) -> int:
        """An accessor of vertex indices, 16 bits wide if they fit."""
        narrow = int(indices.max()) < RESTART_INDEX["uint16"]
        values = indices.reshape(-1).astype(np.uint16 if narrow else np.uint32)
        return self.add("accessors", self._accessor(values, ELEMENT_ARRAY_BUFFER))

    def add_image(self, png: bytes, name: str) -> int:
        """An embedded PNG."""
        view = {"bufferView": self.add_view(png, {}), "mimeType": "image/png"}
        return self.add("images", view | ({"name": name} if name else {}))

    def to_bytes(self) -> bytes:
        """The whole file."""
        document = dict(self.document)
        if self._extensions:
            document["extensionsUsed"] = sorted(self._extensions)
        if self._binary:
            document["buffers"] = [{"byteLength": len(self._binary)}]
        text = json.dumps(document, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()
        chunks = _chunk(JSON_CHUNK, text, b" ")
        if self._binary:
            chunks += _chunk(BINARY_CHUNK, bytes(self._binary), b"\0")
        return struct.pack("<III", MAGIC, VERSION, 12 + len(chunks)) + chunks

    def _accessor(self, values: NDArray[Any], target: int) -> dict[str, Any]:
        width = 1 if values.ndim == 1 else values.shape[1]
        return {
            "bufferView": self.add_view(values.tobytes(), {"target": target}),
            "componentType": COMPONENT_TYPES[values.dtype.name],
            "count": len(values),
            "type": ELEMENT_TYPES[width],
        }

    def add_view(self, data: bytes, extra: dict[str, Any]) -> int:
        """A buffer view of some bytes. extra: what its object has beside place and length."""
        self._binary += b"\0" * (-len(self._binary) % 4)
        offset = len(self._binary)
        self._binary += data
        return self.add("bufferViews", {"buffer": 0, "byteOffset": offset, "byteLength": len(data)} | extra)


def _chunk(kind: int, data: bytes, padding: bytes) -> bytes:
    padded = data + padding * (-len(data) % 4)
    return struct.pack("<II", len(padded), kind) + padded
