"""Meshes of a glTF file that Draco compressed (KHR_draco_mesh_compression), by DracoPy, which the extra ``draco`` installs."""

from __future__ import annotations

import numpy as np

from app.scene.gltf_file import GltfFile
from app.scene.gltf_schema import Primitive


def decompress(file: GltfFile, primitive: Primitive, where: str) -> None:
    """Give the accessors of a primitive what Draco holds of them; nothing where the file has them uncompressed too. Raises
    SceneError."""
    draco = primitive.extensions.draco
    if draco is None or not file.is_empty(primitive.attributes.get("POSITION")):
        return
    try:
        import DracoPy
    except ImportError as error:
        raise file.compressed("KHR_draco_mesh_compression") from error
    try:
        mesh = DracoPy.decode(bytes(file.view(draco.buffer_view)))
        faces = np.ascontiguousarray(mesh.faces, np.uint32).reshape(-1, 1)
    except Exception as error:  # whatever the broken bytes lead to
        raise file.error(f"{where}: Draco cannot read it ({' '.join(str(error).split())[:120]})") from error
    held = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
    for name, index in primitive.attributes.items():
        if name in draco.attributes:
            if draco.attributes[name] not in held:
                raise file.error(f"{where}: Draco has no attribute {draco.attributes[name]}, its {name}")
            file.fill(index, held[draco.attributes[name]])
    if primitive.indices is not None:
        file.fill(primitive.indices, faces)
