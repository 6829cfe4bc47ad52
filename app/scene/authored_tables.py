"""What a scene written by hand may say (see authored.py), as tables that are checked when they are read."""

from __future__ import annotations

import datetime
import math
from typing import Annotated, Any, Literal, Self

from pydantic import AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from app.scene import shapes
from app.scene.lights import OUTER, LightKind
from app.scene.model import SCALES
from app.scene.procedural import Procedural
from app.scene.sky import LEAST_TURBIDITY, MOST_TURBIDITY, TURBIDITY, SkyKind, Sun
from app.scene.sun_position import sun_at


def _triple(value: Any) -> Any:
    """One number stands for three."""
    return (value, value, value) if isinstance(value, (int, float)) and not isinstance(value, bool) else value


Vec3 = tuple[float, float, float]
Part01 = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Albedo = Annotated[tuple[Part01, Part01, Part01], BeforeValidator(_triple)]
Emitted = Annotated[tuple[NotNegative, NotNegative, NotNegative], BeforeValidator(_triple)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class SceneTable(Table):
    """exposure: EV beside the automatic one."""

    name: str | None = None
    exposure: Annotated[float, Field(ge=-8.0, le=8.0)] = 0.0
    unit: Literal["m", "cm", "mm", "in", "ft"] = "m"


class TextureTable(Table):
    pattern: Literal["checker", "stripes"] | None = None
    colors: tuple[Albedo, Albedo] | None = None
    image: str | None = None
    repeat: tuple[Positive, Positive] = (1.0, 1.0)

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.pattern is None) == (self.image is None):
            raise ValueError("give either pattern or image")
        if (self.pattern is None) != (self.colors is None):
            raise ValueError("pattern needs two colors, and image none")
        return self


class MaterialTable(Table):
    name: str
    albedo: Albedo | None = None
    emission: Emitted | None = None
    exitance: Emitted | None = None
    texture: TextureTable | None = None
    double_sided: bool = False
    opacity: Part01 = 1.0
    lightmap_scale: Annotated[float, Field(ge=SCALES[0], le=SCALES[1])] = 1.0

    @model_validator(mode="after")
    def _one_light(self) -> Self:
        if self.emission is not None and self.exitance is not None:
            raise ValueError("give either emission or exitance")
        return self


class QuadTable(Table):
    material: str
    origin: Vec3 | None = None
    edge_u: Vec3 | None = None
    edge_v: Vec3 | None = None
    corners: tuple[Vec3, Vec3, Vec3, Vec3] | None = None
    name: str = ""

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        given = [e is not None for e in (self.origin, self.edge_u, self.edge_v)]
        if any(given) if self.corners is not None else not all(given):
            raise ValueError("give either origin, edge_u and edge_v, or corners")
        return self

    def mesh(self) -> shapes.Mesh:
        if self.corners is not None:
            return shapes.polygon(self.corners)
        assert self.origin is not None and self.edge_u is not None and self.edge_v is not None
        return shapes.quad(self.origin, self.edge_u, self.edge_v)


class BoxTable(Table):
    material: str
    center: Vec3
    size: tuple[Positive, Positive, Positive]
    rotate_y: float = 0.0
    inside: bool = False
    without: list[Literal["left", "right", "bottom", "top", "back", "front"]] = []
    name: str = ""

    def mesh(self) -> shapes.Mesh:
        placed = shapes.box(self.size, self.without).transformed(
            shapes.transform(self.center, (0.0, self.rotate_y, 0.0), 1.0)
        )
        return placed.flipped() if self.inside else placed


class MeshTable(Table):
    file: str
    translate: Vec3 = (0.0, 0.0, 0.0)
    rotate: Vec3 = (0.0, 0.0, 0.0)
    scale: Annotated[Vec3, BeforeValidator(_triple)] = (1.0, 1.0, 1.0)
    material: str | None = None
    name: str = ""


class CameraTable(Table):
    name: str
    position: Vec3
    target: Vec3
    yfov_deg: Annotated[float, Field(gt=0.0, lt=180.0)] = 45.0

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if math.dist(self.position, self.target) == 0.0:
            raise ValueError("position and target must differ")
        return self


class LightTable(Table):
    name: str = ""
    kind: LightKind = "point"
    intensity: Emitted
    position: Vec3 | None = None
    direction: Vec3 | None = None
    target: Vec3 | None = None
    inner_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 0.0
    outer_deg: Annotated[float, Field(gt=0.0, le=90.0)] = math.degrees(OUTER)
    range: Positive | None = None
    radius: NotNegative = 0.0
    angle_deg: Annotated[float, Field(ge=0.0, lt=180.0)] = 0.0

    @model_validator(mode="after")
    def _what_the_kind_needs(self) -> Self:
        afar, aims = self.kind == "directional", self.kind != "point"
        if not afar and self.position is None:
            raise ValueError(f"a {self.kind} light needs a position")
        if aims and (self.direction is None) == (self.target is None or self.position is None):
            raise ValueError(f"a {self.kind} light needs either a direction, or a position and a target")
        if aims and not math.hypot(*self.aim):
            raise ValueError("a light needs a direction of some length")
        if self.inner_deg > self.outer_deg:
            raise ValueError("inner_deg must be at most outer_deg")
        given = self.model_fields_set
        odd = given & ({"inner_deg", "outer_deg", "angle_deg"} if self.kind == "point" else set())
        odd |= given & ({"inner_deg", "outer_deg", "range", "radius"} if afar else {"angle_deg"})
        if odd:
            raise ValueError(f"a {self.kind} light has no {sorted(odd)[0]}")
        return self

    @property
    def aim(self) -> Vec3:
        """Where it shines, of any length."""
        if self.direction is not None or self.target is None or self.position is None:
            return self.direction or (0.0, -1.0, 0.0)
        x, y, z = (b - a for a, b in zip(self.position, self.target, strict=True))
        return (x, y, z)


class SunTable(Table):
    azimuth: float | None = None
    height: Annotated[float, Field(gt=0.0, le=90.0)] | None = None
    time: AwareDatetime | None = None
    latitude: Annotated[float, Field(ge=-90.0, le=90.0)] | None = None
    longitude: Annotated[float, Field(ge=-180.0, le=360.0)] | None = None

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        angles = [self.azimuth is not None, self.height is not None]
        place = [self.time is not None, self.latitude is not None, self.longitude is not None]
        if not (all(angles) and not any(place)) and not (all(place) and not any(angles)):
            raise ValueError("give either azimuth and height, or time, latitude and longitude")
        if self.sun.height <= 0:
            raise ValueError(f"the sun is {-self.sun.height:.1f} degrees below the horizon then")
        return self

    @property
    def sun(self) -> Sun:
        if self.azimuth is not None and self.height is not None:
            return Sun(self.azimuth % 360, self.height)
        assert self.time is not None and self.latitude is not None and self.longitude is not None
        return sun_at(self.time.astimezone(datetime.UTC), self.latitude, self.longitude)


class SkyTable(Table):
    kind: SkyKind = "uniform"
    colour: Emitted = (1.0, 1.0, 1.0)
    strength: NotNegative = 1.0
    turbidity: Annotated[float, Field(ge=LEAST_TURBIDITY, le=MOST_TURBIDITY)] = TURBIDITY
    sun: SunTable | None = None
    file: str | None = None
    rotate: float = 0.0

    @model_validator(mode="after")
    def _what_the_kind_needs(self) -> Self:
        if self.kind == "clear" and self.sun is None:
            raise ValueError("a clear sky needs a sun")
        if (self.kind == "image") != (self.file is not None):
            raise ValueError("an image needs a file, and other kinds none")
        return self


class SceneFile(Table):
    """A whole TOML scene."""

    scene: SceneTable = SceneTable()
    material: list[MaterialTable] = []
    quad: list[QuadTable] = []
    box: list[BoxTable] = []
    mesh: list[MeshTable] = []
    procedural: list[Procedural] = []
    camera: list[CameraTable] = []
    light: list[LightTable] = []
    sky: SkyTable | None = None
