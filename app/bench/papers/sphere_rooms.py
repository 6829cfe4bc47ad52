"""Rooms of exactly so many triangles, to measure against: a closed box, a lamp under its ceiling, and spheres in a grid."""

from __future__ import annotations

import math

import numpy as np

from app.errors import UserError
from app.scene.model import Material, Scene
from app.scene.shapes import Mesh, box, icosphere, lathe, merged, quad

ROOM = (8.0, 4.0, 8.0)  # m
SPHERES = {20 * 4**n: n for n in (3, 2, 1, 0)}  # triangles: subdivisions
SHELL = 12 + 2  # triangles of the box and of the lamp
FEWEST = SHELL + 3  # the rest is at least a cone with three sides
FILLED = 0.35  # radius of a sphere over the grid's spacing
LARGEST = 1.5  # m, radius
HEIGHT = -0.3  # m, of the spheres' middle; the floor is at -2, the lamp just below 2
MATERIALS = (
    Material("wall", (0.6, 0.6, 0.6)),
    Material("lamp", (0.2, 0.2, 0.2), (10.0, 10.0, 10.0)),
    Material("sphere", (0.5, 0.5, 0.5)),
)


def room_of(triangles: int) -> Scene:
    """A room of exactly so many triangles. As many spheres of 1280 as fit, then of 320, 80 and 20, and a cone without bottom for
    the rest of 3 to 22. No two triangles of a sphere are coplanar. Raises UserError below 17 triangles."""
    if triangles < FEWEST:
        raise UserError(f"a room of {triangles} triangles: at least {FEWEST} are needed")
    x, y, z = ROOM
    shell = box(ROOM).flipped()
    lamp = quad((-1.0, y / 2 - 0.05, -1.0), (2.0, 0, 0), (0, 0, 2.0))  # faces down
    solids = _solids(triangles - SHELL)
    side = math.ceil(math.sqrt(len(solids)))
    step = x / side
    placed = []
    for i, solid in enumerate(solids):
        radius = min(FILLED * step, LARGEST)
        scaled = Mesh(solid.positions * radius, solid.triangles, solid.uv)
        column, line = i % side, i // side
        placed.append(scaled.moved((column + 0.5) * step - x / 2, HEIGHT, (line + 0.5) * step - z / 2))
    meshes = [shell, lamp, *placed]
    counts = [len(m.triangles) for m in meshes]
    whole = merged(meshes)
    kinds = np.array([0, 1] + [2] * len(placed))
    return Scene(
        name=f"room of {triangles}",
        positions=whole.positions,
        triangles=whole.triangles.astype(np.int32),
        material_ids=np.repeat(kinds, counts).astype(np.int32),
        object_ids=np.repeat(np.arange(len(meshes)), counts).astype(np.int32),
        objects=("walls", "lamp", *(f"solid {k + 1}" for k in range(len(placed)))),
        materials=MATERIALS,
    )


def _solids(triangles: int) -> list[Mesh]:
    """Of radius 1 about the origin."""
    out = []
    for size, subdivisions in SPHERES.items():
        count = max(triangles - 3, 0) // size
        out += [icosphere(1.0, subdivisions)] * count
        triangles -= count * size
    return [*out, lathe([(1.0, -1.0), (0.0, 1.0)], triangles)]
