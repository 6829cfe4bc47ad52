"""A museum hall: a coffered nave with skylights between two rows of columns, panelled walls, exhibits on plinths.

A watertight room about the origin with its floor at y = 0, long along z: some 8000 triangles, from a flat floor of
288 m² to the 3 cm rim of a picture. Light comes from above only, so columns, coffers and plinths cast the shadows that
adaptive subdivision is made for.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from app.scene.shapes import Mesh, box, icosphere, lathe, merged, polygon, quad

AISLE = 2.2  # m from the wall to the column's axis
SOCLE = 0.9  # m, side of a column's base and capital
BEAM = (0.7, 0.5)  # m, width and height of the beam on the columns
PLINTH = (0.8, 1.1)  # m, side and height


class Museum(BaseModel):
    """Lengths in the scene's unit. Uses the materials floor, wall, ceiling, column, plinth, exhibit, picture_a,
    picture_b, picture_c and skylight."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    kind: Literal["museum"]
    name: str = "museum"
    length: Annotated[float, Field(ge=12.0, le=200.0)] = 24.0
    width: Annotated[float, Field(ge=9.0, le=50.0)] = 12.0
    height: Annotated[float, Field(ge=5.0, le=20.0)] = 7.0
    columns: Annotated[int, Field(ge=2, le=40)] = 6
    sides: Annotated[int, Field(ge=6, le=96)] = 24

    def pieces(self) -> list[tuple[str, str, Mesh]]:
        """(object name, material name, mesh) of everything in the hall."""
        return [*self._walls(), *self._ceiling(), *self._columns(), *self._exhibits()]

    @property
    def column_places(self) -> list[float]:
        """z of the columns, evenly along the hall."""
        return [self.length * ((i + 0.5) / self.columns - 0.5) for i in range(self.columns)]

    def _walls(self) -> list[tuple[str, str, Mesh]]:
        length, width, height = self.length, self.width, self.height
        bays = max(round(length / 2.4), 3)
        ends = max(round(width / 2.4), 3)
        sides = {
            "left wall": ((-width / 2, 0, length / 2), (0, 0, -length), bays),
            "right wall": ((width / 2, 0, -length / 2), (0, 0, length), bays),
            "back wall": ((-width / 2, 0, -length / 2), (width, 0, 0), ends),
            "front wall": ((width / 2, 0, length / 2), (-width, 0, 0), ends),
        }
        out = [("floor", "floor", quad((-width / 2, 0, length / 2), (width, 0, 0), (0, 0, -length)))]
        number = 0
        for name, (origin, edge, count) in sides.items():
            frame, panels = coffers(origin, edge, (0, height, 0), count, 3, border=0.25, depth=0.06)
            out.append((name, "wall", merged([frame, *panels])))
            for panel in panels[count : 2 * count]:  # the middle row, at eye level
                out.append((f"picture {number + 1}", f"picture_{'abc'[number % 3]}", _picture(panel)))
                number += 1
        return out

    def _ceiling(self) -> list[tuple[str, str, Mesh]]:
        """Flat aisles, two beams, and the coffered nave with a skylight in every other coffer of its middle row."""
        length, width, height = self.length, self.width, self.height
        axis, (beam_width, beam_height) = width / 2 - AISLE, BEAM
        inner, outer = axis - beam_width / 2, axis + beam_width / 2
        bays = max(round(length / 2.4), 3)
        frame, panels = coffers(
            (-inner, height, -length / 2), (2 * inner, 0, 0), (0, 0, length), 3, bays, border=0.25, depth=0.6
        )
        skylights = {3 * bay + 1 for bay in range(0, bays, 2)}
        closed = [panel for i, panel in enumerate(panels) if i not in skylights]
        aisles = [
            quad((x, height, -length / 2), (width / 2 - outer, 0, 0), (0, 0, length)) for x in (-width / 2, outer)
        ]
        beam = box((beam_width, beam_height, length), without=("top", "front", "back"))
        beams = [beam.moved(x, height - beam_height / 2, 0.0) for x in (-axis, axis)]
        return [
            ("nave", "ceiling", merged([frame, *closed])),
            ("aisles", "ceiling", merged(aisles)),
            ("beams", "column", merged(beams)),
            *((f"skylight {n + 1}", "skylight", panels[i]) for n, i in enumerate(sorted(skylights))),
        ]

    def _columns(self) -> list[tuple[str, str, Mesh]]:
        top = self.height - BEAM[1]
        low, high = 0.3, top - 0.3
        # Entasis: the shaft narrows above its first third, as classical columns do.
        shaft = lathe([(0.36, low), (0.35, low + (high - low) / 3), (0.29, high)], self.sides)
        base = box((SOCLE, low, SOCLE), without=("bottom",)).moved(0.0, low / 2, 0.0)
        capital = box((SOCLE, top - high, SOCLE), without=("top",)).moved(0.0, (top + high) / 2, 0.0)
        column = merged([base, shaft, capital])
        axis = self.width / 2 - AISLE
        places = [(side * axis, z) for side in (-1, 1) for z in self.column_places]
        return [(f"column {i + 1}", "column", column.moved(x, 0.0, z)) for i, (x, z) in enumerate(places)]

    def _exhibits(self) -> list[tuple[str, str, Mesh]]:
        """Plinths between the columns with spheres and vases in turn, and a bench in the middle."""
        side, height = PLINTH
        plinth = box((side, height, side), without=("bottom",)).moved(0.0, height / 2, 0.0)
        sphere = icosphere(0.34, 2).moved(0.0, 0.33, 0.0)
        r, y = np.array([0.14, 0.22, 0.31, 0.33, 0.26, 0.15, 0.11, 0.16]), np.linspace(0.0, 0.75, 8)
        vase = lathe([*np.stack([r, y], axis=1), (0.0, 0.7)], self.sides)
        places = self.column_places
        between = [(a + b) / 2 for a, b in pairwise(places)]
        spots = [(sign * (self.width / 2 - AISLE), z) for sign in (-1, 1) for z in between]
        bench = box((0.6, 0.45, 2.0), without=("bottom",)).moved(0.0, 0.225, 0.0)
        out = [("bench", "plinth", bench)]
        for i, (x, z) in enumerate(spots):
            out.append((f"plinth {i + 1}", "plinth", plinth.moved(x, 0.0, z)))
            out.append((f"exhibit {i + 1}", "exhibit", (sphere, vase)[i % 2].moved(x, height, z)))
        return out


def coffers(
    origin: ArrayLike, edge_u: ArrayLike, edge_v: ArrayLike, nx: int, ny: int, *, border: float, depth: float
) -> tuple[Mesh, list[Mesh]]:
    """A rectangle that faces along edge_u × edge_v, cut into nx × ny cells, each with a panel sunk by ``depth``.

    Returns the frame with its reveals, and the panels row by row. ``border`` is the width of the frame about a panel.
    """
    o, u, v = (np.asarray(x, np.float64) for x in (origin, edge_u, edge_v))
    unit_u, unit_v = u / np.linalg.norm(u), v / np.linalg.norm(v)
    sunk = -depth * np.cross(unit_u, unit_v)
    frame, panels = [], []
    for j in range(ny):
        for i in range(nx):
            outer = [o + u * (a / nx) + v * (b / ny) for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
            inner = [
                corner + border * (su * unit_u + sv * unit_v)
                for corner, (su, sv) in zip(outer, ((1, 1), (-1, 1), (-1, -1), (1, -1)), strict=True)
            ]
            deep = [corner + sunk for corner in inner]
            for k in range(4):
                n = (k + 1) % 4
                frame.append(polygon([outer[k], outer[n], inner[n], inner[k]]))
                frame.append(polygon([inner[k], inner[n], deep[n], deep[k]]))
            panels.append(polygon(deep))
    return merged(frame), panels


def _picture(panel: Mesh) -> Mesh:
    """A thin box without back on the middle of a panel."""
    a, b, c, d = panel.positions
    centre, u, v = (a + b + c + d) / 4, (b - a) * 0.35, (d - a) * 0.3
    out = np.cross(u, v)
    out *= 0.03 / np.linalg.norm(out)
    back = [centre - u - v, centre + u - v, centre + u + v, centre - u + v]
    front = [corner + out for corner in back]
    rim = [polygon([back[k], back[(k + 1) % 4], front[(k + 1) % 4], front[k]]) for k in range(4)]
    return merged([polygon(front), *rim])
