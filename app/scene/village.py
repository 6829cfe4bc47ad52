"""A village of blocks at night: houses about a square, a cave under a hill, trees, lanterns, torches and glowing windows.

Every block is 1 m, and its faces towards the air are the patches of [Shcherbakov19], whose scene of 63 125 patches is a world of
blocks as well. Deterministic: heights and places come from the integer hash of grotto.py. The square is about the origin, with
its ground at y = 0; the cave lies to the north (-z); the world is open above only.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from app.scene.blocks import AIR, Blocks, Box, Span
from app.scene.grotto import fractal_noise, random01
from app.scene.shapes import Mesh, quad

MATERIALS = (
    "grass",
    "earth",
    "stone",
    "path",
    "cobble",
    "wood",
    "planks",
    "plaster",
    "roof",
    "leaves",
    "cloth",
    "lantern",
    "lamp",
    "window",
    "torch",
)
DEPTH, SKY = 8, 44  # blocks below the village's ground, and above it
PLOT = 16  # blocks from the middle of one plot to that of the next
STREET = 1  # blocks to each side of a street's middle
HILL = 12  # blocks from the village to the middle of the hill in which the cave is
CAVE = (11.0, 6.5, 8.5)  # half its axes
TREE = 6  # blocks between trees, about
WALL = 4  # blocks, height of a house up to its roof


class Village(BaseModel):
    """``blocks``: blocks, of 1 m, along each side of the world; the number of houses, trees and lamps grows with its area.
    Uses the materials in MATERIALS and moon."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    kind: Literal["village"]
    blocks: Annotated[int, Field(ge=80, le=1000, multiple_of=2)] = 140
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 3

    def pieces(self) -> list[tuple[str, str, Mesh]]:
        """(object name, material name, mesh) of the surface of all blocks, and of the moon, a square that looks down."""
        side, high = 4 * round(self.blocks / 44), round(0.6 * self.blocks)
        moon = quad((0.3 * self.blocks, high, 0.25 * self.blocks), (side, 0, 0), (0, 0, side))
        return [*self.world().pieces(), ("moon", "moon", moon)]

    def world(self) -> Blocks:
        """All blocks."""
        x, z = self._spans
        size = (self.blocks, DEPTH + SKY, self.blocks)
        world = Blocks(size, (x[0], -DEPTH, z[0]), MATERIALS)
        ground = self._terrain(world)
        self._cave(world, ground)
        self._square(world)
        self._plots(world)
        self._lanterns(world)
        self._forest(world, ground)
        return world

    @property
    def rings(self) -> int:
        """Of plots about the square."""
        return max(1, round(self.blocks / 64))

    @property
    def half(self) -> int:
        """Blocks from the middle of the square to the end of the village."""
        return PLOT * self.rings + PLOT // 2

    @property
    def hill(self) -> int:
        """z of the middle of the hill."""
        return -self.half - HILL

    @property
    def _spans(self) -> tuple[Span, Span]:
        """Of x and of z; the village lies south of the middle, for the hill."""
        north = self.blocks // 2 + self.blocks // 8
        return (-self.blocks // 2, self.blocks // 2), (-north, self.blocks - north)

    def _random(self, *numbers: int) -> float:
        """In [0, 1), depends on its numbers and the seed alone."""
        seed = self.seed
        for number in numbers:
            seed = int(random01(number % 2**32, seed) * 2**32)
        return seed / 2.0**32

    def _terrain(self, world: Blocks) -> NDArray[np.int64]:
        """Lay the ground: grass on earth on stone, flat in the village, a hill, rising towards the ends of the world. Returns y
        of the first air (x, z)."""
        (x0, x1), (z0, z1) = self._spans
        x, z = (a + 0.5 for a in np.meshgrid(np.arange(x0, x1), np.arange(z0, z1), indexing="ij"))
        noise = fractal_noise(np.stack([x / 26.0, np.zeros_like(x), z / 26.0], -1).reshape(-1, 3), self.seed)
        outside = np.hypot(*(np.maximum(np.abs(a) - self.half, 0.0) for a in (x, z)))
        rim = np.minimum(np.minimum(x - x0, x1 - x), np.minimum(z - z0, z1 - z))
        rolling = _smooth(outside / 16.0) * (2.0 + 7.0 * noise.reshape(x.shape)) + 9.0 * _smooth(1.0 - rim / 14.0) ** 2
        from_hill = np.hypot(x, z - self.hill)
        rolling += (15.0 + 4.0 * noise.reshape(x.shape)) * _smooth(1.25 - from_hill / 18.0)
        height = np.clip(np.floor(rolling + 0.5), -3, SKY - 14).astype(np.int64)
        height[(np.abs(x) < self.half) & (np.abs(z) < self.half)] = 0
        y = np.arange(-DEPTH, SKY)[None, :, None]
        below = height[:, None] - y  # 1 is the topmost block
        for material, first in (("stone", 4), ("earth", 2), ("grass", 1)):
            thing, number = world.numbers("terrain", material)
            mine = (below >= first) & (world.material == AIR)
            world.thing[mine], world.material[mine] = thing, number
        crag = (below == 1) & (height[:, None] >= 12)
        world.material[crag] = world.numbers("terrain", "stone")[1]
        for middle in range(-self.half, self.half + 1, PLOT):
            street, all_ = (middle - STREET, middle + STREET + 1), (-self.half - STREET, self.half + STREET + 1)
            world.fill("terrain", "path", (street, (-1, 0), all_))
            world.fill("terrain", "path", (all_, (-1, 0), street))
        return height

    def _cave(self, world: Blocks, ground: NDArray[np.int64]) -> None:
        """Dig a hall under the hill and a tunnel to the village; torches along both."""
        a, b, c = CAVE
        x, y, z = ((-14, 15), (-5, 9), (self.hill - 11, self.hill + 11))
        where = world.within((x, y, z))
        grid = np.stack(np.meshgrid(*(np.arange(*s) + 0.5 for s in (x, y, z)), indexing="ij"), -1)
        relative = (grid - [0.0, 1.0, self.hill]) / [a, b, c]
        noise = fractal_noise(grid.reshape(-1, 3) / 7.0, self.seed + 1).reshape(grid.shape[:-1])
        roof = ground[where[0], None, where[2]] - 3
        hollow = (np.linalg.norm(relative, axis=-1) < 1.0 + 0.55 * noise) & (grid[..., 1] < roof) & (grid[..., 1] > -3)
        deep = (world.material[where] != AIR) & (grid[..., 1] < roof + 1)
        number, stone = world.numbers("cave", "stone")
        world.thing[where][deep], world.material[where][deep] = number, stone
        world.material[where][hollow] = AIR
        for k in range(self.hill + 6, -self.half):  # the tunnel and, before it, a way through whatever rises there
            bend = round(1.6 * np.sin((k + self.half + STREET) / 3.0))
            low, high = bend - 1, bend + 2
            covered = ground[bend - self._spans[0][0], k - self._spans[1][0]] > 4
            world.fill("cave", "path", ((low, high), (-1, 0), (k, k + 1)))
            world.dig(((low, high), (0, 3 if covered else 12), (k, k + 1)))
            if covered and k - self.hill in (8, 11):  # one on either side
                side = low - 1 if k % 2 else high
                world.fill("tunnel torches", "torch", ((side, side + 1), (1, 2), (k, k + 1)))
        for i in range(7):
            angle = 2.0 * np.pi * (i + 0.5) / 7
            spot = int(0.72 * a * np.sin(angle)), self.hill + int(0.72 * c * np.cos(angle))
            self._stand(world, f"torch {i + 1}", spot, "torch", 1)

    def _stand(self, world: Blocks, thing: str, spot: tuple[int, int], light: str, high: int) -> None:
        """A post with a light on the first block below y = 1 that has air above it; nothing where there is none."""
        x, z = ((a, a + 1) for a in spot)
        column = world.material[world.within((x, (-DEPTH, 2), z))].reshape(-1)
        if column.size and column[-1] == AIR:
            floor = int(np.flatnonzero(column).max()) + 1 - DEPTH
            self._post(world, thing, (spot[0], floor, spot[1]), light, high)

    def _post(self, world: Blocks, thing: str, foot: tuple[int, int, int], light: str, high: int) -> None:
        """A light on a post of so many blocks."""
        x, y, z = ((a, a + 1) for a in foot)
        world.fill(thing, "wood", (x, (y[0], y[0] + high), z))
        world.fill(thing, light, (x, (y[0] + high, y[1] + high), z))

    def _square(self, world: Blocks) -> None:
        """Cobbles, a well under a roof, and two benches."""
        world.fill("square", "cobble", ((-6, 6), (-1, 0), (-6, 6)))
        world.fill("well", "cobble", ((-2, 2), (0, 1), (-2, 2)))
        world.dig(((-1, 1), (-4, 1), (-1, 1)))
        for x in (-2, 1):
            world.fill("well", "wood", ((x, x + 1), (1, 4), (-2, -1)))
            world.fill("well", "wood", ((x, x + 1), (1, 4), (1, 2)))
        world.fill("well", "roof", ((-3, 3), (4, 5), (-3, 3)))
        world.fill("well", "roof", ((-2, 2), (5, 6), (-2, 2)))
        world.fill("well", "lantern", ((-1, 1), (3, 4), (-1, 1)))
        for x in (-5, 4):
            world.fill("benches", "planks", ((x, x + 1), (0, 1), (-2, 2)))

    def _plots(self, world: Blocks) -> None:
        """Houses and gardens about the square; none on the way to the cave."""
        houses, trees = 0, 0
        ring = range(-self.rings, self.rings + 1)
        # from the square outwards, so that the first houses stand about it in every village
        for i, j in sorted(((i, j) for i in ring for j in ring), key=lambda p: (max(map(abs, p)), p)):
            if i == 0 and j <= 0:
                continue
            place = (PLOT * i, PLOT * j)
            if max(abs(i), abs(j)) == 1 or self._random(i, j, 1) < 0.6:
                houses += 1
                _House(
                    world, f"house {houses}", place, self._turn(i, j), [self._random(i, j, 10 + k) for k in range(20)]
                )
            else:
                for k, (dx, dz) in enumerate(((-4, -3), (3, 4), (3, -4))):
                    trees += 1
                    self._tree(world, f"garden tree {trees}", place[0] + dx, 0, place[1] + dz, (i, j, k))

    def _turn(self, i: int, j: int) -> int:
        """Quarter turns that bring a door from the south to the side of the square."""
        if abs(i) >= abs(j):
            return 1 if i < 0 else 3
        return 0 if j < 0 else 2

    def _lanterns(self, world: Blocks) -> None:
        """One at each crossing, and along the way to the cave."""
        beside = [a - 2 if a > 0 else a + 2 for a in range(-self.half, self.half + 1, PLOT)]
        spots = [(x, z) for x in beside for z in beside]
        spots += [(3 * (-1) ** k, -PLOT // 2 - 5 - 7 * k) for k in range((self.half - PLOT // 2) // 7)]
        for i, spot in enumerate(spots):
            self._stand(world, f"lantern {i + 1}", spot, "lantern", 2)

    def _forest(self, world: Blocks, ground: NDArray[np.int64]) -> None:
        """Trees where the ground rolls, and here and there a lantern among them."""
        (x0, x1), (z0, z1) = self._spans
        trees, lanterns = 0, 0
        for x in range(x0 + 4, x1 - 4, TREE):
            for z in range(z0 + 4, z1 - 4, TREE):
                at_x, at_z = (a + int(4 * self._random(x, z, k)) - 2 for k, a in enumerate((x, z)))
                beyond = max(abs(at_x), abs(at_z)) - self.half
                way = abs(at_x) < 6 and self.hill < at_z < 0
                height = int(ground[at_x - x0, at_z - z0])
                if beyond < 4 or way or height > 14:
                    continue
                kind = self._random(x, z, 2)
                if kind < 0.57:
                    trees += 1
                    self._tree(world, f"tree {trees}", at_x, height, at_z, (x, z, 3))
                elif kind > 0.87:
                    lanterns += 1
                    self._post(world, f"forest lantern {lanterns}", (at_x, height, at_z), "lantern", 2)

    def _tree(self, world: Blocks, thing: str, x: int, y: int, z: int, numbers: tuple[int, ...]) -> None:
        """A trunk and a crown of three steps."""
        tall, wide = 4 + int(3 * self._random(*numbers, 0)), 2 + int(1.4 * self._random(*numbers, 1))
        for reach, low, high in ((wide, tall - 2, tall), (wide - 1, tall, tall + 1), (wide - 2, tall + 1, tall + 2)):
            spans = ((x - reach, x + reach + 1), (y + low, y + high), (z - reach, z + reach + 1))
            where = world.within(spans)
            air = world.material[where] == AIR
            number, material = world.numbers(thing, "leaves")
            world.thing[where][air], world.material[where][air] = number, material
        world.fill(thing, "wood", ((x, x + 1), (y, y + tall), (z, z + 1)))


class _House:
    """A house on a plot, built as it is made: its door looks south (+z) before it is turned by so many quarters."""

    def __init__(self, world: Blocks, name: str, place: tuple[int, int], turn: int, chances: list[float]) -> None:
        """chances: random numbers in [0, 1)."""
        self.world, self.name, self.place, self.turn = world, name, place, turn
        large = chances[0] < 0.6
        self.x, self.z = (5, 4 + int(2 * chances[1])) if large else (4, 4)
        self._walls(chances[2:])
        self._roof()
        self._rooms(large)

    def _box(self, x: Span, y: Span, z: Span) -> Box:
        """In the world."""
        for _ in range(self.turn):
            x, z = z, (1 - x[1], 1 - x[0])
        return (x[0] + self.place[0], x[1] + self.place[0]), y, (z[0] + self.place[1], z[1] + self.place[1])

    def _fill(self, material: str, x: Span, y: Span, z: Span) -> None:
        self.world.fill(self.name, material, self._box(x, y, z))

    def _dig(self, x: Span, y: Span, z: Span) -> None:
        self.world.dig(self._box(x, y, z))

    def _walls(self, chances: list[float]) -> None:
        """Plaster between posts and beams of wood on a row of cobbles; windows that glow or are holes, an open door."""
        x, z = (-self.x, self.x + 1), (-self.z, self.z + 1)
        for material, y in (("cobble", (-1, 1)), ("plaster", (1, WALL - 1)), ("wood", (WALL - 1, WALL))):
            self._fill(material, x, y, z)
        for corner_x in (-self.x, self.x):
            for corner_z in (-self.z, self.z):
                self._fill("wood", (corner_x, corner_x + 1), (0, WALL), (corner_z, corner_z + 1))
        self._dig((1 - self.x, self.x), (0, WALL), (1 - self.z, self.z))
        self._fill("planks", (1 - self.x, self.x), (-1, 0), (1 - self.z, self.z))
        along_x = [(at, wall) for wall in (-self.z, self.z) for at in (-3, 2)]
        along_z = [(at, wall) for wall in (-self.x, self.x) for at in (-2, 2)]
        holes = [((at, at + 2), (wall, wall + 1)) for at, wall in along_x]
        holes += [((wall, wall + 1), (at, at + 1)) for at, wall in along_z]
        for (span_x, span_z), chance in zip(holes, chances, strict=False):
            self._dig(span_x, (1, 3), span_z)
            if chance < 0.55:
                self._fill("window", span_x, (1, 3), span_z)
        self._dig((0, 1), (0, 2), (self.z, self.z + 1))
        self._fill("path", (0, 1), (-1, 0), (self.z + 1, 8 - STREET))

    def _roof(self) -> None:
        """Steps up to a ridge along x, the ceiling under them, a chimney."""
        for step in range(self.z + 2):
            inset = (-1 - self.z + step, self.z + 2 - step)
            self._fill("roof", (-1 - self.x, self.x + 2), (WALL + step, WALL + step + 1), inset)
        self._fill("planks", (1 - self.x, self.x), (WALL, WALL + 1), (1 - self.z, self.z))
        self._fill("cobble", (self.x - 2, self.x - 1), (WALL + 1, WALL + self.z + 3), (-2, -1))

    def _rooms(self, two: bool) -> None:
        """A lamp, a table, a shelf and a bed; behind a wall with a doorway, where there are two rooms, the bed has its own."""
        back = 1 - self.z
        self._fill("lamp", (0, 1), (WALL - 1, WALL), (1, 2))
        self._fill("wood", (-2, 0), (0, 1), (1, 3))
        self._fill("planks", (self.x - 1, self.x), (0, 3), (self.z - 2, self.z))
        self._fill("cloth", (1 - self.x, 3 - self.x), (0, 1), (back, back + 1))
        if two:
            self._fill("planks", (1 - self.x, self.x), (0, WALL), (-1, 0))
            self._dig((2, 3), (0, 2), (-1, 0))
            self._fill("lamp", (0, 1), (WALL - 1, WALL), (back, back + 1))
            self._fill("wood", (self.x - 1, self.x), (0, 1), (back, back + 1))


def _smooth(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """0 below 0, 1 above 1, 3t² - 2t³ between."""
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
