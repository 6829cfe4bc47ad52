"""The closed form of a furnace: a closed shell that emits and reflects alike everywhere, B = E / (1 - ρ).

What its surfaces receive is H = (B - E) / ρ = B, everywhere. form_factors.py has the closed forms between two surfaces.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.sides import weld
from app.scene.model import F64, Scene


def furnace_irradiance(scene: Scene) -> F64:
    """(3,) [W/m²] on all surfaces of a scene that ``no_furnace`` says nothing against."""
    material = scene.materials[scene.material_ids[0]]
    return np.asarray(np.pi * np.array(material.emission) / (1 - np.array(material.albedo)))


def no_furnace(scene: Scene) -> str | None:
    """Why a scene is no furnace, None if it is one: every side alike, and one closed shell with its fronts inwards."""
    if scene.lit_by_sky:
        return "light comes from the sky"
    if scene.lit_by_lights:
        return "light comes from lamps without area"
    used = [scene.materials[k] for k in np.unique(scene.material_ids)]
    looks = {(m.albedo, m.emission, m.albedo_texture, m.emission_texture, m.double_sided) for m in used}
    albedo, _, *textures, double_sided = looks.pop()
    if looks or any(textures) or double_sided or scene.colours is not None:
        return "not all surfaces are alike"
    if max(albedo) >= 1.0:
        return "nothing absorbs light"
    points, triangles = weld(scene)
    edges = {(int(t[k]), int(t[k - 2])) for t in triangles for k in range(3)}
    closed = len(edges) == 3 * len(triangles) and all((b, a) in edges for a, b in edges)
    corners = points[triangles]
    volume = np.einsum("mc,mc->m", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
    pieces = _pieces(triangles)
    return None if closed and volume < 0 and pieces == 1 else "not a single closed shell, seen from inside"


def _pieces(triangles: NDArray[np.int32]) -> int:
    """Connected ones."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    used, label = np.unique(np.stack([first, second]), return_inverse=True)
    label = label.reshape(2, -1)
    graph = coo_array((np.ones(len(first)), tuple(label)), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])
