"""The part of the glTF 2.0 JSON that is read here, as pydantic models: wrong types and values are found before use.

Names are the specification's in snake case. Whatever is not listed is ignored, as the specification asks.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic.alias_generators import to_camel

from app.scene.lights import OUTER
from app.scene.model import SCALES

Index = Annotated[int, Field(ge=0, lt=2**31)]
Size = Annotated[int, Field(ge=0, lt=2**53)]
Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Vec4 = tuple[float, float, float, float]


class Model(BaseModel):
    model_config = ConfigDict(alias_generator=to_camel, extra="ignore", allow_inf_nan=False)


class Asset(Model):
    version: str


class Empty(Model):
    pass


class BufferExtensions(Model):
    ext_meshopt: Empty | None = Field(default=None, alias="EXT_meshopt_compression")
    khr_meshopt: Empty | None = Field(default=None, alias="KHR_meshopt_compression")


class Buffer(Model):
    uri: str | None = None
    byte_length: Size
    extensions: BufferExtensions = BufferExtensions()


class BufferView(Model):
    buffer: Index
    byte_offset: Size = 0
    byte_length: Size
    byte_stride: Annotated[int, Field(ge=0, le=252)] = 0


class SparseIndices(Model):
    buffer_view: Index
    byte_offset: Size = 0
    component_type: Literal[5121, 5123, 5125]


class SparseValues(Model):
    buffer_view: Index
    byte_offset: Size = 0


class Sparse(Model):
    count: Index
    indices: SparseIndices
    values: SparseValues


class Accessor(Model):
    buffer_view: Index | None = None
    byte_offset: Size = 0
    component_type: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    normalized: bool = False
    count: Index
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    sparse: Sparse | None = None


class Image(Model):
    uri: str | None = None
    buffer_view: Index | None = None
    name: str = ""


class Sampler(Model):
    mag_filter: int = 9729
    wrap_s: Literal[10497, 33071, 33648] = 10497
    wrap_t: Literal[10497, 33071, 33648] = 10497


class OtherSource(Model):
    source: Index | None = None


class TextureExtensions(Model):
    webp: OtherSource | None = Field(default=None, alias="EXT_texture_webp")


class Texture(Model):
    sampler: Index | None = None
    source: Index | None = None
    extensions: TextureExtensions = TextureExtensions()


class TextureTransform(Model):
    offset: Vec2 = (0.0, 0.0)
    rotation: float = 0.0
    scale: Vec2 = (1.0, 1.0)
    tex_coord: Index | None = None


class TextureInfoExtensions(Model):
    transform: TextureTransform | None = Field(default=None, alias="KHR_texture_transform")


class TextureInfo(Model):
    index: Index
    tex_coord: Index = 0
    extensions: TextureInfoExtensions = TextureInfoExtensions()


class MetallicRoughness(Model):
    base_color_factor: Vec4 | None = None
    base_color_texture: TextureInfo | None = None


class SpecularGlossiness(Model):
    diffuse_factor: Vec4 | None = None
    diffuse_texture: TextureInfo | None = None


class EmissiveStrength(Model):
    emissive_strength: Annotated[float, Field(ge=0.0)] = 1.0


class Transmission(Model):
    transmission_factor: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    transmission_texture: TextureInfo | None = None


class MaterialExtensions(Model):
    emissive_strength: EmissiveStrength | None = Field(default=None, alias="KHR_materials_emissive_strength")
    specular_glossiness: SpecularGlossiness | None = Field(default=None, alias="KHR_materials_pbrSpecularGlossiness")
    transmission: Transmission | None = Field(default=None, alias="KHR_materials_transmission")
    unlit: Empty | None = Field(default=None, alias="KHR_materials_unlit")


def _table(extras: object) -> object:
    """Extras may be anything; only a table has something that is ours."""
    return extras if isinstance(extras, (dict, BaseModel)) else {}


class MaterialExtras(Model):
    """What of a material's extras is ours."""

    lightmap_scale: Annotated[float, Field(ge=SCALES[0], le=SCALES[1], alias="lightmap_scale")] = 1.0


class Material(Model):
    name: str = ""
    pbr_metallic_roughness: MetallicRoughness = MetallicRoughness()
    emissive_factor: Vec3 = (0.0, 0.0, 0.0)
    emissive_texture: TextureInfo | None = None
    alpha_mode: str = "OPAQUE"
    alpha_cutoff: Annotated[float, Field(ge=0.0)] = 0.5
    double_sided: bool = False
    extensions: MaterialExtensions = MaterialExtensions()
    extras: Annotated[MaterialExtras, BeforeValidator(_table)] = MaterialExtras()


class Draco(Model):
    buffer_view: Index
    attributes: dict[str, Index]


class PrimitiveExtensions(Model):
    draco: Draco | None = Field(default=None, alias="KHR_draco_mesh_compression")


class Primitive(Model):
    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    targets: list[dict[str, Index]] = []
    mode: Annotated[int, Field(ge=0, le=6)] = 4
    extensions: PrimitiveExtensions = PrimitiveExtensions()


class Mesh(Model):
    name: str = ""
    primitives: list[Primitive]
    weights: list[float] = []


class Skin(Model):
    joints: list[Index]
    inverse_bind_matrices: Index | None = None


class Instancing(Model):
    attributes: dict[str, Index]


class LightIndex(Model):
    light: Index


class NodeExtensions(Model):
    instancing: Instancing | None = Field(default=None, alias="EXT_mesh_gpu_instancing")
    light: LightIndex | None = Field(default=None, alias="KHR_lights_punctual")


class Node(Model):
    name: str = ""
    children: list[Index] = []
    mesh: Index | None = None
    camera: Index | None = None
    skin: Index | None = None
    weights: list[float] = []
    matrix: Annotated[list[float], Field(min_length=16, max_length=16)] | None = None
    translation: Vec3 = (0.0, 0.0, 0.0)
    rotation: Vec4 = (0.0, 0.0, 0.0, 1.0)
    scale: Vec3 = (1.0, 1.0, 1.0)
    extensions: NodeExtensions = NodeExtensions()


NotNegative = Annotated[float, Field(ge=0.0)]


class Spot(Model):
    inner_cone_angle: NotNegative = 0.0
    outer_cone_angle: NotNegative = OUTER


class LightExtras(Model):
    """What a bake keeps of a light besides."""

    radius: NotNegative = 0.0
    angle: NotNegative = 0.0


class Light(Model):
    name: str = ""
    type: Literal["point", "spot", "directional"]
    color: Vec3 = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    range: Annotated[float, Field(gt=0.0)] | None = None
    spot: Spot = Spot()
    extras: LightExtras = LightExtras()


class Lights(Model):
    lights: list[Light] = []


class Perspective(Model):
    yfov: float


class Camera(Model):
    name: str = ""
    type: str
    perspective: Perspective | None = None


class ImageBasedLight(Model):
    name: str = ""
    rotation: Vec4 = (0.0, 0.0, 0.0, 1.0)
    intensity: NotNegative = 1.0
    specular_images: Annotated[list[tuple[Index, Index, Index, Index, Index, Index]], Field(min_length=1)]


class ImageBasedLights(Model):
    lights: list[ImageBasedLight] = []


class SceneExtensions(Model):
    image_based: LightIndex | None = Field(default=None, alias="EXT_lights_image_based")


class SceneNodes(Model):
    name: str = ""
    nodes: list[Index] = []
    extensions: SceneExtensions = SceneExtensions()


class DocumentExtensions(Model):
    image_based: ImageBasedLights = Field(default=ImageBasedLights(), alias="EXT_lights_image_based")
    punctual: Lights = Field(default=Lights(), alias="KHR_lights_punctual")


class Document(Model):
    """A whole glTF file without its binary data."""

    asset: Asset
    extensions_required: list[str] = []
    scene: Index = 0
    scenes: list[SceneNodes] = []
    nodes: list[Node] = []
    meshes: list[Mesh] = []
    skins: list[Skin] = []
    cameras: list[Camera] = []
    materials: list[Material] = []
    textures: list[Texture] = []
    images: list[Image] = []
    samplers: list[Sampler] = []
    accessors: list[Accessor] = []
    buffer_views: list[BufferView] = []
    buffers: list[Buffer] = []
    extensions: DocumentExtensions = DocumentExtensions()
