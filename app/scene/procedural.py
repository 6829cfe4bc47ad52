"""Scenes' building blocks that are computed: the table of generators that ``[[procedural]]`` can name.

Each is a pydantic model whose fields are its parameters; ``pieces()`` gives (object name, material name, mesh) triples.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.scene import shapes
from app.scene.grotto import Grotto
from app.scene.museum import Museum
from app.scene.shapes import Mesh
from app.scene.village import Village

Vec3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]


class Solid(BaseModel):
    """What single solids share: one material, a place, and ``inside`` to face inwards."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    name: str = ""
    material: str
    center: Vec3 = (0.0, 0.0, 0.0)
    inside: bool = False

    def _pieces(self, kind: str, mesh: Mesh) -> list[tuple[str, str, Mesh]]:
        placed = mesh.moved(*self.center)
        return [(self.name or kind, self.material, placed.flipped() if self.inside else placed)]


class Icosphere(Solid):
    """A sphere of 20·4^subdivisions triangles about ``center``."""

    kind: Literal["icosphere"]
    radius: Positive
    subdivisions: Annotated[int, Field(ge=0, le=8)] = 3

    def pieces(self) -> list[tuple[str, str, Mesh]]:
        return self._pieces(self.kind, shapes.icosphere(self.radius, self.subdivisions))


class Cylinder(Solid):
    """An upright closed cylinder about ``center``."""

    kind: Literal["cylinder"]
    radius: Positive
    height: Positive
    sides: Annotated[int, Field(ge=3, le=1024)] = 32

    def pieces(self) -> list[tuple[str, str, Mesh]]:
        mesh = shapes.cylinder(self.radius, self.height, self.sides).moved(0.0, -self.height / 2, 0.0)
        return self._pieces(self.kind, mesh)


Procedural = Annotated[Museum | Grotto | Village | Icosphere | Cylinder, Field(discriminator="kind")]
