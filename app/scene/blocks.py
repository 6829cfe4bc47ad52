"""Worlds of blocks: cubes of 1 m in a grid, and the surface where they meet the air.

The unit faces of one plane, material and thing are merged into rectangles: runs along one axis first, then equal runs side by
side. Where a corner of one rectangle lies within a side of another, that side is split there: rays are watertight along whole
edges that two triangles share, and along no others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.scene.shapes import Mesh

I64 = NDArray[np.int64]
Span = tuple[int, int]  # the first block and the one behind the last
Box = tuple[Span, Span, Span]  # along x, y and z
AIR = 0


@dataclass(frozen=True, eq=False)
class Faces:
    """Rectangles of unit faces that look along one axis: all are (n,) but axis and side.

    axis: 0 to 2; side: 0 towards lower coordinates, 1 towards higher. plane: their coordinate along the axis [m]; u, v: of their
    lowest corner along the next two axes (u × v is the axis); width, height along these; thing, material: numbers.
    """

    axis: int
    side: int
    plane: I64
    u: I64
    v: I64
    width: I64
    height: I64
    thing: I64
    material: I64

    def at(self, along_u: I64, along_v: I64, which: I64) -> I64:
        """(k, 3) points so many metres from the lowest corners of the faces ``which``, all (k,)."""
        place = self.plane[which], self.u[which] + along_u, self.v[which] + along_v
        return np.stack([place[(k - self.axis) % 3] for k in range(3)], axis=1)

    def merged(self) -> Faces:
        """Fewer rectangles of the same faces, for faces of height 1: joined along u, then those alike along v."""
        kind = (self.plane, self.thing, self.material)
        order = np.lexsort((self.u, self.v, *kind))
        rows = self._taken(order)
        first = np.flatnonzero(rows._starts((rows.plane, rows.thing, rows.material, rows.v), rows.u, rows.width))
        joined = rows._taken(first, width=np.add.reduceat(rows.width, first))
        order = np.lexsort((joined.v, joined.width, joined.u, joined.plane, joined.thing, joined.material))
        runs = joined._taken(order)
        alike = (runs.plane, runs.thing, runs.material, runs.u, runs.width)
        first = np.flatnonzero(runs._starts(alike, runs.v, runs.height))
        return runs._taken(first, height=np.add.reduceat(runs.height, first))

    def _starts(self, alike: tuple[I64, ...], place: I64, length: I64) -> NDArray[np.bool_]:
        """(n,) whether each face, in order, does not continue the one before it."""
        starts = np.ones(len(place), bool)
        starts[1:] = place[1:] != place[:-1] + length[:-1]
        for values in alike:
            starts[1:] |= values[1:] != values[:-1]
        return starts

    def _taken(self, rows: I64, width: I64 | None = None, height: I64 | None = None) -> Faces:
        width, height = self.width[rows] if width is None else width, self.height[rows] if height is None else height
        plane, u, v, thing, material = (x[rows] for x in (self.plane, self.u, self.v, self.thing, self.material))
        return Faces(self.axis, self.side, plane, u, v, width, height, thing, material)


class Blocks:
    """A grid of blocks, all of it air to begin with.

    material (x, y, z) u8: AIR, or 1 + the number of the block's material in ``materials``; thing (x, y, z) i32: the number of
    the object that it is part of, by name in ``things``; lowest (3,): coordinates of the grid's first block. What lies beyond the
    sides of the grid and below it counts as blocks, what lies above it as air.
    """

    def __init__(self, size: tuple[int, int, int], lowest: tuple[int, int, int], materials: tuple[str, ...]) -> None:
        self.material = np.zeros(size, np.uint8)
        self.thing = np.zeros(size, np.int32)
        self.lowest = np.array(lowest)
        self.materials = materials
        self.things: dict[str, int] = {}

    def numbers(self, thing: str, material: str) -> tuple[int, int]:
        """Of an object, a new one if need be, and of a material, as ``thing`` and ``material`` hold them."""
        return self.things.setdefault(thing, len(self.things)), self.materials.index(material) + 1

    def fill(self, thing: str, material: str, box: Box) -> None:
        """Put blocks into a box."""
        where = self.within(box)
        self.thing[where], self.material[where] = self.numbers(thing, material)

    def dig(self, box: Box) -> None:
        """Make a box air."""
        self.material[self.within(box)] = AIR

    def within(self, box: Box) -> tuple[slice, slice, slice]:
        """Where in the arrays a box lies, as far as it is in the grid."""
        limits = zip(box, self.lowest.tolist(), self.material.shape, strict=True)
        x, y, z = (slice(*np.clip([a - low, b - low], 0, size).tolist()) for (a, b), low, size in limits)
        return x, y, z

    def faces(self) -> Iterator[Faces]:
        """The unit faces between blocks and air, for each axis and side."""
        solid = self.material != AIR
        for axis in range(3):
            for side in (0, 1):
                beyond = np.full(solid.shape, (axis, side) != (1, 1))
                one: list[slice] = [slice(None)] * 3
                next_: list[slice] = [slice(None)] * 3
                one[axis], next_[axis] = slice(None, -1), slice(1, None)
                here, there = (one, next_) if side else (next_, one)
                beyond[tuple(here)] = solid[tuple(there)]
                at = np.nonzero(solid & ~beyond)
                place = [at[(axis + k) % 3] + self.lowest[(axis + k) % 3] for k in range(3)]
                length = np.ones(len(at[0]), np.int64)
                thing, material = self.thing[at].astype(np.int64), self.material[at].astype(np.int64) - 1
                yield Faces(axis, side, place[0] + side, place[1], place[2], length, length, thing, material)

    def pieces(self) -> list[tuple[str, str, Mesh]]:
        """(object name, material name, mesh) of the surface; the parts of an object of several materials are called ``object,
        material``. uv counts blocks along the axes of each plane."""
        rectangles = [faces.merged() for faces in self.faces()]
        is_corner = np.zeros(np.array(self.material.shape) + 1, bool)
        for faces in rectangles:
            which = np.arange(len(faces.u))
            for wide, high in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = faces.at(wide * faces.width, high * faces.height, which)
                is_corner[tuple((corner - self.lowest).T)] = True
        meshes, owners = zip(*(self._triangulated(faces, is_corner) for faces in rectangles), strict=True)
        owner = np.concatenate(owners)  # of each vertex: the number of its thing and material
        starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes)])
        triangles = np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)])
        order, by_owner = np.argsort(owner, kind="stable"), np.argsort(owner[triangles[:, 0]], kind="stable")
        renamed = np.empty(len(owner), np.int64)
        renamed[order] = np.arange(len(owner))
        positions, uv = (np.concatenate([getattr(m, name) for m in meshes])[order] for name in ("positions", "uv"))
        triangles = renamed[triangles[by_owner]]
        kinds, first = np.unique(owner[order], return_index=True)
        thing, material = np.divmod(kinds, len(self.materials))
        several = np.bincount(thing, minlength=len(self.things)) > 1
        ends = np.append(first[1:], len(owner))
        cuts = np.searchsorted(triangles[:, 0], np.append(first, len(owner)))
        names, out = list(self.things), []
        for k, (t, m) in enumerate(zip(thing.tolist(), material.tolist(), strict=True)):
            name = f"{names[t]}, {self.materials[m]}" if several[t] else names[t]
            span = slice(first[k], ends[k])
            mesh = Mesh(positions[span], triangles[cuts[k] : cuts[k + 1]] - first[k], uv[span])
            out.append((name, self.materials[m], mesh))
        return out

    def _triangulated(self, faces: Faces, is_corner: NDArray[np.bool_]) -> tuple[Mesh, I64]:
        """Each rectangle as a fan, with a vertex wherever a corner of any rectangle lies on its border; of each vertex the number
        of thing and material. is_corner: of lattice points of the grid."""
        count = len(faces.u)
        border = 2 * (faces.width + faces.height)
        which = np.repeat(np.arange(count), border)
        step = np.arange(len(which)) - np.repeat(
            np.cumsum(border) - border, border
        )  # from the lowest corner, along u first
        w, h = faces.width[which], faces.height[which]
        along_u = np.minimum(step, w) - np.clip(step - w - h, 0, w)
        along_v = np.clip(step - w, 0, h) - np.clip(step - 2 * w - h, 0, h)
        side = (step >= w).astype(np.int64) + (step >= w + h) + (step >= 2 * w + h)
        point = faces.at(along_u, along_v, which)
        kept = is_corner[tuple((point - self.lowest).T)]
        point, which, side = point[kept], which[kept], side[kept]
        this = np.arange(len(which))
        first = np.searchsorted(which, np.arange(count))
        following = np.where(np.append(which[1:] == which[:-1], False), this + 1, first[which])
        # the fan starts where no side that its first point lies on has another point inside, else in the middle
        on_side = np.bincount(4 * which + side, minlength=4 * count).reshape(
            -1, 4
        )  # the corner where it starts, and points inside
        is_start = np.append(True, np.diff(4 * which + side) != 0)
        alone = np.where(is_start, on_side[which, side] + on_side[which, side - 1] == 2, on_side[which, side] == 2)
        apex = np.full(count, -1)
        apex[which[alone][::-1]] = this[alone][::-1]
        split = np.flatnonzero(apex < 0)
        apex[split] = len(point) + np.arange(len(split))
        opposite = (this != apex[which]) & (following != apex[which])
        triangles = np.stack([apex[which], this, following], axis=1)[opposite]
        middle = faces.at(np.zeros_like(split), np.zeros_like(split), split).astype(np.float64)
        in_plane = [(faces.axis + 1) % 3, (faces.axis + 2) % 3]
        middle[:, in_plane] += np.stack([faces.width, faces.height], axis=1)[split] / 2
        positions = np.concatenate([point.astype(np.float64), middle])
        mesh = Mesh(positions, triangles, positions[:, in_plane] * [1.0, -1.0])
        of = np.concatenate([which, split])
        return mesh if faces.side else mesh.flipped(), (faces.thing * len(self.materials) + faces.material)[of]
