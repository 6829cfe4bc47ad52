"""The scenes of the hard cases, each of few parts: rooms, plates, slits, boxes, slivers.

Every part is an object, so that light can be asked for by its name. Edges are multiples of 1/16 m where texels should end there.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from app.scene.model import F64, Material, Scene
from app.scene.shapes import FACES, Mesh, box, icosphere, merged, polygon, quad, transform
from app.scene.validate import Part, validate

Piece = tuple[str, Mesh, Material]  # name of the object, its surface, its material

BLACK = Material("black", (0.0,) * 3)
WALL = Material("wall", (0.6,) * 3)
SHEET = Material("sheet", (0.5,) * 3, double_sided=True)
SPHERES = {"small": 3, "large": 6}  # subdivisions: 1280 and 81 920 triangles
LAMP_SHARE = 1e-6  # of the room's surface
GAP = 1e-4  # m, between a lamp and the ceiling of a room of 1 m
SLIT = 1e-3  # m
SLIVER = 1e-4  # m wide, 1 m long
THICKNESS = 1e-3  # m, of a thin wall


def lamp(exitance: float, albedo: float = 0.0) -> Material:
    """Grey, with exitance E [W/m²]; its emission is the radiance E/π."""
    return Material("lamp", (albedo,) * 3, (exitance / np.pi,) * 3)


def scene_of(name: str, pieces: Iterable[Piece]) -> Scene:
    """The pieces through the gate that every file passes; those of one name are one object."""
    pieces = list(pieces)
    objects = list(dict.fromkeys(piece[0] for piece in pieces))
    materials = list(dict.fromkeys(piece[2] for piece in pieces))
    parts = [Part(m.positions, m.triangles, objects.index(o), materials.index(paint)) for o, m, paint in pieces]
    # its albedos too, which files may not have above MOST_ALBEDO
    return validate(name, name, parts, objects, materials).with_materials(tuple(materials))


def walls(
    material: Material,
    size: ArrayLike = (1.0, 1.0, 1.0),
    at: ArrayLike = (0.0, 0.0, 0.0),
    *,
    without: Sequence[str] = (),
) -> list[Piece]:
    """The walls of a room that face inward, each an object named as in FACES; its lowest corner ``at``."""
    extent, low = np.asarray(size, np.float64), np.asarray(at, np.float64)
    middle = low + extent / 2
    return [
        (face, box(extent, [other for other in FACES if other != face]).flipped().moved(*middle), material)
        for face in FACES
        if face not in without
    ]


def across(axis: int, at: float, low: ArrayLike, high: ArrayLike, *, along: bool = True) -> Mesh:
    """A rectangle across an axis, that faces along it or against it. low, high: of y, z or z, x or x, y for axis 0, 1, 2."""
    (u0, v0), (u1, v1) = np.asarray(low, np.float64), np.asarray(high, np.float64)
    corners = np.full((4, 3), float(at))
    corners[:, (axis + 1) % 3], corners[:, (axis + 2) % 3] = (u0, u1, u1, u0), (v0, v0, v1, v1)
    return polygon(corners if along else corners[::-1])


def furnace(albedo: float) -> Scene:
    return scene_of("furnace", walls(lamp(1.0, albedo)))


def bright_and_faint(bright: float, faint: float) -> Scene:
    """Two closed rooms, alike but for the exitance of their ceilings, with no plane in common."""
    pieces = []
    for name, exitance, at in (("bright", bright, (0, 0, 0)), ("faint", faint, (3.0, 0.37, 0.21))):
        for face, mesh, material in walls(Material("third", (0.3,) * 3), at=at):
            pieces.append((f"{name} {face}", mesh, lamp(exitance, 0.3) if face == "top" else material))
    return scene_of("bright and faint", pieces)


def small_lamp(exitance: float) -> Scene:
    """A lamp in the middle of a black room, that faces down."""
    half = np.sqrt(LAMP_SHARE * 6) / 2
    shade = across(1, 0.5, (0.5 - half,) * 2, (0.5 + half,) * 2, along=False)
    return scene_of("small lamp", [*walls(BLACK), ("lamp", shade, lamp(exitance))])


def lamp_near_ceiling(gap: float) -> Scene:
    """A room with a lamp so far below the ceiling; at 0 it fills a hole in it."""
    low, high = 0.375, 0.625
    source = ("lamp", across(1, 1 - gap, (low, low), (high, high), along=False), lamp(10.0))
    if gap > 0:
        return scene_of("lamp near ceiling", [*walls(WALL), source])
    ring = [((0, 0), (low, 1)), ((high, 0), (1, 1)), ((low, 0), (high, low)), ((low, high), (high, 1))]
    around = merged([across(1, 1.0, *corners, along=False) for corners in ring])
    return scene_of("lamp in ceiling", [*walls(WALL, without=["top"]), ("top", around, WALL), source])


def boxes_on_floor() -> Scene:
    """A room whose ceiling shines, with a box that stands on the floor, one that touches floor and wall, and one halfway through
    the floor. All have their bottoms."""
    size = (2.0, 1.0, 2.0)
    pieces = [(n, m, lamp(1.0, 0.5) if n == "top" else WALL) for n, m, _ in walls(WALL, size)]
    for name, (x, y, z) in {
        "stands": (0.75, 0.25, 1.5),
        "touches": (0.25, 0.25, 0.5),
        "pierces": (1.5, 0.0, 0.75),
    }.items():
        pieces.append((name, box((0.5, 0.5, 0.5)).moved(x, y, z), WALL))
    return scene_of("boxes on floor", pieces)


def thin_walls() -> Scene:
    """Three rooms in a row, the middle one lit: behind a sheet without thickness, and behind a thin slab."""
    slab = box((THICKNESS, 1.0, 1.0)).moved(2.0, 0.5, 0.5)
    source = across(1, 0.875, (0.25, 1.25), (0.75, 1.75), along=False)
    pieces = [("sheet", across(0, 1.0, (0, 0), (1, 1)), SHEET), ("slab", slab, WALL), ("lamp", source, lamp(10.0))]
    return scene_of("thin walls", [*walls(WALL, (3.0, 1.0, 1.0)), *pieces])


def furnished(floor: Mesh | None = None, more: Sequence[Piece] = (), material: Material = WALL) -> Scene:
    """A room with a lamp and a table. floor: another mesh in its place; more: pieces."""
    pieces = [(n, floor if floor and n == "bottom" else m, material) for n, m, _ in walls(WALL)]
    source = across(1, 0.875, (0.25, 0.25), (0.5, 0.5), along=False)
    table = across(1, 0.25, (0.375, 0.375), (0.875, 0.875))
    return scene_of("furnished", [*pieces, ("lamp", source, lamp(10.0)), ("table", table, SHEET), *more])


def slivers() -> Scene:
    """The furnished room, its floor cut by strips of 1 m by 0.1 mm."""
    cuts = [0.0, 0.3, 0.3 + SLIVER, 0.5, 0.5 + SLIVER, 0.5 + 2 * SLIVER, 0.8, 0.8 + SLIVER, 1.0]
    strips = [across(1, 0.0, (0.0, a), (1.0, b)) for a, b in itertools.pairwise(cuts)]
    return furnished(merged(strips))


def spoiled() -> Scene:
    """The furnished room with triangles that are points and lines, and with its floor and its table twice."""
    line = Mesh(
        np.array([[0.1, 0.5, 0.1], [0.5, 0.5, 0.5], [0.9, 0.5, 0.9]]),
        np.array([[0, 1, 2], [1, 1, 1], [0, 1, 0]]),
        np.zeros((3, 2)),
    )
    twice = [
        ("bottom", across(1, 0.0, (0, 0), (1, 1)), WALL),
        ("table", across(1, 0.25, (0.375, 0.375), (0.875, 0.875)), SHEET),
    ]
    return furnished(more=[("dirt", line, WALL), *twice])


def double_sided(turned: bool) -> Scene:
    """The furnished room, walls lit on both sides; ``turned``: every other triangle of walls and table winds the other way."""
    scene = furnished(material=SHEET)
    triangles = scene.triangles.copy()
    if turned:
        odd = np.flatnonzero(scene.sides)[::2]
        triangles[odd] = triangles[odd][:, ::-1]
    return dataclasses.replace(scene, triangles=triangles)


def t_junctions() -> Scene:
    """The furnished room, turned, its floor of tiles whose corners lie within the edges of their neighbours and of the walls."""
    tiles = []
    for row, (z0, z1) in enumerate(itertools.pairwise((0.0, 0.3, 0.7, 1.0))):
        cuts = (0.0, 1 / 3, 1.0) if row % 2 else (0.0, 0.55, 0.9, 1.0)
        tiles += [across(1, 0.0, (z0, x0), (z1, x1)) for x0, x1 in itertools.pairwise(cuts)]
    return turned(furnished(merged(tiles)))


def turned(scene: Scene) -> Scene:
    return transformed(scene, transform((0, 0, 0), (31.0, 47.0, 13.0), 1.0))


def transformed(scene: Scene, matrix: F64) -> Scene:
    return dataclasses.replace(scene, positions=scene.positions @ matrix[:3, :3].T + matrix[:3, 3])


def slit(width: float) -> Scene:
    """Two black rooms of 1 m behind each other; the far wall of the first shines at a slit of this width in the wall between."""
    low, high = 0.5 - width / 2, 0.5 + width / 2
    sides = [((0, 0), (1, low)), ((0, high), (1, 1))] if width else [((0, 0), (1, 1))]
    between = merged([across(0, 1.0, *corners) for corners in sides])
    shell = [(n, m, lamp(1.0) if n == "left" else BLACK) for n, m, _ in walls(BLACK, (2.0, 1.0, 1.0))]
    return scene_of("slit", [*shell, ("between", between, Material("dark sheet", (0.0,) * 3, double_sided=True))])


def labyrinth(cells: int = 5, door: float = 0.25) -> Scene:
    """Cells of 1 m in a row with doors at alternate ends, the last one shut; the lamp is in the first."""
    shell = walls(WALL, (float(cells), 1.0, 1.0))
    inner = []
    for i in range(1, cells):
        z = (0.0, 1.0) if i == cells - 1 else (door, 1.0) if i % 2 else (0.0, 1.0 - door)
        inner.append((f"wall {i}", across(0, float(i), (0, z[0]), (1, z[1])), SHEET))
    source = across(1, 0.875, (0.25, 0.25), (0.75, 0.75), along=False)
    return scene_of("labyrinth", [*shell, *inner, ("lamp", source, lamp(10.0))])


def furnace_with_ball(size: str) -> Scene:
    """A furnace with a ball of tiny triangles, all of albedo 1/2 and exitance 1."""
    glow = lamp(1.0, 0.5)
    ball = icosphere(0.3, SPHERES[size]).moved(0.5, 0.5, 0.5)
    return scene_of("furnace with ball", [*walls(glow), ("ball", ball, glow)])


def corner(degrees: float) -> Scene:
    """Two plates of 1 m² that meet along the z axis: a lamp, and a black one at this angle to it that faces it."""
    away = (np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0)
    source, plate = quad((0, 0, 0), (0, 0, 1), (1, 0, 0)), quad((0, 0, 0), away, (0, 0, 1))
    return scene_of("corner", [("lamp", source, lamp(1.0)), ("plate", plate, BLACK)])
