"""Vertices of a glTF primitive as its morph targets and the joints of its skin place them (glTF 2.0, 3.7.2.2 and 3.7.3.3).

A node without weights takes its mesh's; animations are left out, so that joints stand as their nodes do in the file.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.scene.gltf_file import GltfFile
from app.scene.gltf_schema import Primitive, Skin
from app.scene.model import F64


def joint_matrices(file: GltfFile, skin: Skin, worlds: Mapping[int, F64]) -> F64 | None:
    """(j, 4, 4) world-from-mesh matrices of a skin's joints, from the world-from-node matrices of the scene's nodes; None where a
    joint is no node of the scene."""
    if not skin.joints or any(joint not in worlds for joint in skin.joints):
        return None
    matrices = np.stack([worlds[joint] for joint in skin.joints])
    if skin.inverse_bind_matrices is None:
        return matrices
    inverse = file.accessor(skin.inverse_bind_matrices, "MAT4").astype(np.float64)
    if len(inverse) < len(matrices):
        raise file.error(f"a skin has {len(matrices)} joints and {len(inverse)} inverse bind matrices")
    return np.asarray(matrices @ inverse[: len(matrices)].reshape(-1, 4, 4).swapaxes(1, 2))  # stored by columns


def morphed(
    file: GltfFile, primitive: Primitive, weights: Sequence[float], name: str, values: NDArray[Any], where: str
) -> NDArray[Any]:
    """An attribute (n, 3) plus its weighted displacements; weights without a target have no effect."""
    for weight, target in zip(weights, primitive.targets, strict=False):
        if weight == 0.0 or name not in target:
            continue
        moves = file.accessor(target[name], "VEC3")
        if len(moves) != len(values):
            raise file.error(f"{where}: a morph target has {len(moves)} {name} for {len(values)}")
        values = values + weight * moves.astype(np.float64)
    return values


def skinning(file: GltfFile, primitive: Primitive, joints: F64, count: int, where: str) -> F64 | None:
    """(n, 4, 4) what places each of ``count`` vertices: the mean of its joints' matrices by its weights, those of the first joint
    where all are 0; None where the primitive has no joints."""
    blended, total = np.zeros((count, 4, 4)), np.zeros(count)
    for k in itertools.count():
        names = f"JOINTS_{k}", f"WEIGHTS_{k}"
        if not all(name in primitive.attributes for name in names):
            if k == 0:
                return None
            break
        indices, weights = (file.accessor(primitive.attributes[name], "VEC4") for name in names)
        if indices.dtype.kind != "u" or len(indices) != count or len(weights) != count:
            raise file.error(
                f"{where}: {names[0]} and {names[1]} must be whole numbers and weights of {count} vertices"
            )
        if len(indices) and int(indices.max()) >= len(joints):
            raise file.error(f"{where}: joint {indices.max()} is out of range: there are {len(joints)}")
        for column in range(4):
            blended += weights[:, column, None, None].astype(np.float64) * joints[indices[:, column]]
        total += weights.astype(np.float64).sum(axis=1)
    lost = ~(total > 0.0)
    blended[lost], total[lost] = joints[0], 1.0
    return np.asarray(blended / total[:, None, None])


def turned_normals(linear: F64, normals: NDArray[Any]) -> F64:
    """Normals (…, n, 3) after linear parts (…, n or 1, 3, 3) of transforms, of any length, on the side that the front of
    triangles is on once mirrored ones are wound the other way.

    A normal turns with the cofactor matrix, which also exists for singular transforms.
    """
    cofactors = np.stack(
        [np.cross(linear[..., (i + 1) % 3, :], linear[..., (i + 2) % 3, :]) for i in range(3)], axis=-2
    )
    cofactors = np.where(np.linalg.det(linear)[..., None, None] < 0.0, -cofactors, cofactors)
    return np.asarray(np.einsum("...ij,...j->...i", cofactors, normals.astype(np.float64)))
