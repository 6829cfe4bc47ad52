"""A glTF 2.0 file taken apart: GLB chunks, JSON, buffers and accessors, every offset checked before it is used.

Nothing here knows about scenes. Every defect raises ``SceneError`` with the number of the thing that is wrong.
"""

from __future__ import annotations

import base64
import struct
import urllib.parse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from app.errors import SceneError
from app.scene.gltf_schema import Accessor, Buffer, Document, Sparse
from app.scene.images import path_inside
from app.scene.validate import MAX_TRIANGLES

T = TypeVar("T")

GLB_MAGIC = b"glTF"
JSON_CHUNK, BIN_CHUNK = 0x4E4F534A, 0x004E4942
UNCOMPRESSED = "write it uncompressed first, e.g. gltf-transform copy in.glb out.glb"
# Extensions that a file may require: read here, or without effect on diffuse light.
KNOWN_EXTENSIONS = {
    "EXT_lights_image_based",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
}
COMPRESSIONS = {  # what compresses a file, and the way out where it cannot be read
    "EXT_meshopt_compression": ("meshopt", UNCOMPRESSED),
    "KHR_draco_mesh_compression": ("Draco", f"install what reads it, pip install 'glowtree[draco]', or {UNCOMPRESSED}"),
    "KHR_meshopt_compression": ("meshopt", UNCOMPRESSED),
    "KHR_texture_basisu": ("KTX2", "write its pictures as PNG first, e.g. gltf-transform ktxdecompress in.glb out.glb"),
}
DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MAX_ELEMENTS = 3 * MAX_TRIANGLES


class GltfFile:
    """One file: ``document`` is its checked JSON, ``text`` that as written; ``accessor`` and ``view`` give its binary data."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            data = path.read_bytes()
        except OSError as error:
            raise SceneError(path, f"cannot be read: {error.strerror}") from error
        if not data:
            raise self.error("the file is empty")
        self.text, self._bin = self._split(data)
        try:
            self.document = Document.model_validate_json(self.text)
        except ValidationError as error:
            if any(problem["loc"] == ("asset",) and problem["type"] == "missing" for problem in error.errors()):
                raise self.error('not a glTF file: it has no "asset"') from error
            raise self.error(first_problem(error)) from error
        self._check_versions()
        self._buffers: dict[int, memoryview] = {}
        self._filled: dict[int, NDArray[Any]] = {}

    def error(self, reason: str) -> SceneError:
        return SceneError(self.path, reason)

    def compressed(self, extension: str) -> SceneError:
        """The error that this extension's data cannot be read here."""
        what, way_out = COMPRESSIONS[extension]
        return self.error(f"compressed with {what} ({extension}); {way_out}")

    def pick(self, things: Sequence[T], index: int, what: str) -> T:
        """``things[index]``, or the SceneError that there is no such thing."""
        if index >= len(things):
            raise self.error(f"{what} {index} does not exist: there are {len(things)}")
        return things[index]

    def _split(self, data: bytes) -> tuple[bytes, memoryview | None]:
        """The JSON text and the binary chunk, if any."""
        if not data.startswith(GLB_MAGIC):
            text = data.removeprefix(b"\xef\xbb\xbf").lstrip()
            if not text.startswith(b"{"):
                raise self.error("neither a GLB file nor glTF JSON")
            return text, None
        if len(data) < 20:
            raise self.error(f"truncated: {len(data)} bytes are too few for a GLB header")
        version, length = struct.unpack_from("<II", data, 4)
        if version != 2:
            raise self.error(f"GLB version {version}: only version 2 can be read")
        if length > len(data):
            raise self.error(f"truncated: {len(data)} of {length} bytes are there")
        chunks: dict[int, memoryview] = {}
        offset = 12
        while offset + 8 <= length:
            size, kind = struct.unpack_from("<II", data, offset)
            offset += 8
            if offset + size > length:
                raise self.error(f"a chunk of {size} bytes reaches past the end of the file")
            chunks.setdefault(kind, memoryview(data)[offset : offset + size])
            offset += size
        if JSON_CHUNK not in chunks:
            raise self.error("the GLB has no JSON chunk")
        return bytes(chunks[JSON_CHUNK]), chunks.get(BIN_CHUNK)

    def _check_versions(self) -> None:
        if not self.document.asset.version.startswith("2."):
            raise self.error(f"glTF version {self.document.asset.version}: only 2.x can be read")
        for name in self.document.extensions_required:
            if name not in KNOWN_EXTENSIONS:
                if name in COMPRESSIONS:
                    raise self.compressed(name)
                raise self.error(f"requires the extension {name}, which is not supported")

    def _buffer(self, index: int) -> memoryview:
        if index not in self._buffers:
            buffer = self.pick(self.document.buffers, index, "buffer")
            data = memoryview(self._buffer_data(index, buffer))
            if len(data) < buffer.byte_length:
                raise self.error(f"buffer {index} is truncated: {len(data)} of {buffer.byte_length} bytes are there")
            self._buffers[index] = data[: buffer.byte_length]
        return self._buffers[index]

    def _buffer_data(self, index: int, buffer: Buffer) -> bytes | memoryview:
        if buffer.uri is None:
            if buffer.extensions.ext_meshopt is not None or buffer.extensions.khr_meshopt is not None:
                raise self.compressed("EXT_meshopt_compression")
            if index != 0 or self._bin is None:
                raise self.error(f"buffer {index} has no data")
            return self._bin
        data = self.resource(buffer.uri)
        if data is None:
            raise self.error(f"buffer {index}: '{_shortened(buffer.uri)}' is not a readable file in the scene's folder")
        return data

    def resource(self, uri: str) -> bytes | None:
        """What a URI means: base64 data, or a file inside the scene's folder; None if neither."""
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            if not head.endswith(";base64"):
                return None
            try:
                return base64.b64decode(urllib.parse.unquote_to_bytes(body), validate=True)
            except ValueError:
                return None
        path = path_inside(self.path.parent, uri)
        try:
            return None if path is None else path.read_bytes()
        except OSError:
            return None

    def view(self, index: int) -> memoryview:
        """The bytes of a buffer view."""
        view = self.pick(self.document.buffer_views, index, "bufferView")
        buffer = self._buffer(view.buffer)
        if view.byte_offset + view.byte_length > len(buffer):
            raise self.error(f"bufferView {index} reaches past the end of buffer {view.buffer}")
        return buffer[view.byte_offset : view.byte_offset + view.byte_length]

    def is_empty(self, index: int | None) -> bool:
        """Whether an accessor holds zeros only: what extensions fill."""
        if index is None or index >= len(self.document.accessors):
            return False
        accessor = self.document.accessors[index]
        return accessor.buffer_view is None and accessor.sparse is None

    def fill(self, index: int, values: NDArray[Any]) -> None:
        """Let ``values`` (n, components) be those of an accessor."""
        accessor = self.pick(self.document.accessors, index, "accessor")
        if values.ndim != 2 or values.shape[1] != COMPONENTS.get(accessor.type):
            raise self.error(f"accessor {index} is {accessor.type}: its compressed data are not")
        self._filled[index] = values

    def accessor(self, index: int, *kinds: str) -> NDArray[Any]:
        """(count, components) values of an accessor of one of these types; normalized integers become f32."""
        accessor = self.pick(self.document.accessors, index, "accessor")
        if accessor.type not in kinds:
            raise self.error(f"accessor {index} is {accessor.type}: {' or '.join(kinds)} is needed")
        if accessor.count > MAX_ELEMENTS:
            raise self.error(f"accessor {index} has {accessor.count:,} elements: at most {MAX_ELEMENTS:,} are allowed")
        if index in self._filled:
            values = self._filled[index]
            return _normalized(values) if accessor.normalized and values.dtype.kind in "iu" else values
        width, dtype = COMPONENTS[accessor.type], np.dtype(DTYPES[accessor.component_type])
        if accessor.buffer_view is None:
            values = np.zeros((accessor.count, width), dtype)
        else:
            stride = self.document.buffer_views[accessor.buffer_view].byte_stride if self._has_view(accessor) else 0
            where = f"accessor {index}"
            values = self._read(accessor.buffer_view, accessor.byte_offset, accessor.count, width, dtype, stride, where)
        if accessor.sparse is not None:
            values = self._with_sparse(values, accessor.sparse, f"accessor {index}")
        return _normalized(values) if accessor.normalized and dtype.kind in "iu" else values

    def _has_view(self, accessor: Accessor) -> bool:
        return accessor.buffer_view is not None and accessor.buffer_view < len(self.document.buffer_views)

    def _read(
        self, view: int, offset: int, count: int, width: int, dtype: np.dtype[Any], stride: int, where: str
    ) -> NDArray[Any]:
        data = self.view(view)
        element = width * dtype.itemsize
        step = stride or element
        if step < element:
            raise self.error(f"{where}: a stride of {step} bytes is too small for elements of {element}")
        need = offset + (count - 1) * step + element if count else 0
        if need > len(data):
            raise self.error(f"{where} needs {need} bytes of bufferView {view}, which has {len(data)}")
        if count == 0:
            return np.zeros((0, width), dtype)
        return np.ndarray((count, width), dtype, data, offset, (step, dtype.itemsize))

    def _with_sparse(self, values: NDArray[Any], sparse: Sparse, where: str) -> NDArray[Any]:
        if sparse.count > len(values):
            raise self.error(f"{where}: {sparse.count} sparse values for {len(values)} elements")
        spots, width = sparse.indices, values.shape[1]
        index_type = np.dtype(DTYPES[spots.component_type])
        indices = self._read(spots.buffer_view, spots.byte_offset, sparse.count, 1, index_type, 0, f"{where} (sparse)")
        first, start = sparse.values.buffer_view, sparse.values.byte_offset
        replacing = self._read(first, start, sparse.count, width, values.dtype, 0, f"{where} (sparse)")
        if sparse.count and int(indices.max()) >= len(values):
            raise self.error(f"{where}: sparse index {indices.max()} is out of range: there are {len(values)} elements")
        values = values.copy()
        values[indices[:, 0]] = replacing
        return values


def first_problem(error: ValidationError) -> str:
    """The first thing that pydantic found wrong, in one line: where, what, and how many more there are."""
    problems = error.errors(include_url=False, include_context=False, include_input=False)
    where = ".".join(str(step) for step in problems[0]["loc"])
    message = " ".join(problems[0]["msg"].split())
    message = message.removeprefix("Value error, ")
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return f"{where}: {message}{more}" if where else f"{message}{more}"


def _normalized(values: NDArray[Any]) -> NDArray[np.float32]:
    """Integers as fractions of their largest value, signed ones not below -1 (glTF 2.0, 3.6.2.2)."""
    fractions: NDArray[np.float32] = (values / np.iinfo(values.dtype).max).astype(np.float32)
    return np.maximum(fractions, np.float32(-1.0))


def _shortened(uri: str) -> str:
    return uri if len(uri) <= 60 else uri[:57] + "..."
