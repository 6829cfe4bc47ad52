"""What a .glow file says of a session, as tables of plain values that are checked when they are read."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.scene.lights import LightKind
from app.scene.model import SCALES
from app.scene.sky import LEAST_TURBIDITY, MOST_TURBIDITY, SkyKind

RIGID = 1e-6  # of a camera's axes, how far from orthonormal they may be
Vec3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Emitted = tuple[NotNegative, NotNegative, NotNegative]
Unit = Annotated[float, Field(ge=0.0, le=1.0)]
Angle = Annotated[float, Field(ge=0.0, le=math.pi)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True)


class SunTable(Table):
    azimuth: float
    height: Annotated[float, Field(ge=0.0, le=90.0)]


class FileTable(Table):
    """A file beside the session. relative: to the folder of the session's; digest: of its content."""

    source: str
    relative: str | None = None
    digest: str | None = None


class SkyTable(Table):
    """picture: where that of a sky is which is none of the scene's."""

    kind: SkyKind
    colour: Emitted
    strength: NotNegative
    sun: SunTable | None = None
    turbidity: Annotated[float, Field(ge=LEAST_TURBIDITY, le=MOST_TURBIDITY)]
    rotation: float = 0.0
    picture: FileTable | None = None

    @model_validator(mode="after")
    def _sun_of_a_clear_sky(self) -> Self:
        if self.kind == "clear" and self.sun is None:
            raise ValueError("a clear sky needs a sun")
        return self


class LightTable(Table):
    """range: none where it does not end."""

    name: str
    kind: LightKind
    intensity: Emitted
    position: Vec3
    direction: Vec3
    inner: Angle
    outer: Angle
    range: Annotated[float, Field(gt=0.0)] | None
    radius: NotNegative
    angle: Angle
    on: bool

    @model_validator(mode="after")
    def _unit_direction(self) -> Self:
        if abs(math.hypot(*self.direction) - 1) > RIGID:
            raise ValueError("direction must have length 1")
        return self


class MaterialTable(Table):
    """What of a material was edited. index: among materials of one name."""

    name: str
    index: Annotated[int, Field(ge=0)]
    albedo: tuple[Unit, Unit, Unit] | None = None
    emission: Emitted | None = None
    opacity: Unit | None = None


class KeyTable(Table):
    """A material. index: among those of one name."""

    name: str
    index: Annotated[int, Field(ge=0)]


class ScaleTable(KeyTable):
    """How finely a material is cut into texels, where that is not as its file says."""

    lightmap_scale: Annotated[float, Field(ge=SCALES[0], le=SCALES[1])]


class AreaLampTable(Table):
    """A lamp with area that was added."""

    name: str
    position: Vec3
    emission: Emitted
    size: tuple[Positive, Positive]
    direction: Vec3
    across: Vec3
    of: KeyTable | None = None

    @model_validator(mode="after")
    def _upright(self) -> Self:
        lengths = math.hypot(*self.direction), math.hypot(*self.across)
        if max(abs(length - 1) for length in lengths) > RIGID or abs(np.dot(self.direction, self.across)) > RIGID:
            raise ValueError("direction and across must have length 1 and a right angle between them")
        return self


class MovedTable(Table):
    """Surfaces of the scene's own that are elsewhere."""

    key: KeyTable
    shift: Vec3


class CameraTable(Table):
    """world_from_camera: rows of a rigid matrix."""

    world_from_camera: tuple[tuple[float, float, float, float], ...]
    yfov: Annotated[float, Field(gt=0.0, lt=math.pi)]
    distance: Annotated[float, Field(gt=0.0)]

    @model_validator(mode="after")
    def _rigid(self) -> Self:
        matrix = np.array(self.world_from_camera)
        if matrix.shape != (4, 4) or not np.allclose(matrix[3], (0, 0, 0, 1)):
            raise ValueError("must be a 4 by 4 matrix")
        turn = matrix[:3, :3]
        if np.abs(turn @ turn.T - np.eye(3)).max() > RIGID or np.linalg.det(turn) < 0:
            raise ValueError("must be rigid")
        return self


class SceneTable(FileTable):
    """Where the scene came from and how it was read."""

    file: dict[str, Any]
    default_light: bool
    sky: SkyTable | None = None


class Document(Table):
    """lights, sky: all of them, where they were edited. area_lamps, removed, moved, scales: lamps with area that were added,
    materials whose surfaces were removed or moved, and those that are cut more or less finely. settings: as of
    ``settings.checked``."""

    glowtree: str
    scene: SceneTable
    settings: dict[str, Any]
    area_lamps: list[AreaLampTable] = []
    removed: list[KeyTable] = []
    moved: list[MovedTable] = []
    scales: list[ScaleTable] = []
    materials: list[MaterialTable] = []
    lights: list[LightTable] | None = None
    sky: SkyTable | None = None
    no_sky: bool = False
    camera: CameraTable
    bookmarks: dict[Annotated[str, Field(pattern="^[1-9]$")], CameraTable] = {}

    @property
    def edits(self) -> tuple[object, ...]:
        """What of it was made by hand and would be missed."""
        surfaces = self.area_lamps, self.removed, self.moved, self.scales
        return *surfaces, self.materials, self.lights, self.sky, self.no_sky, self.bookmarks


__all__ = [
    *("AreaLampTable", "CameraTable", "Document", "FileTable", "KeyTable", "LightTable", "MaterialTable", "MovedTable"),
    *("ScaleTable", "SceneTable", "SkyTable", "SunTable"),
]
