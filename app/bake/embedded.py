"""One GLB that any viewer shows lit, without extensions: what surfaces send out is a picture, its ``emissiveTexture``.

The picture is light × albedo / π plus emission, exposed, cut off at 1 and in 8 bits sRGB: it shows the bake, it can't be relit or
exposed anew. Charts whose albedo has a texture are as fine as that, all others as the lightmap.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from app import __version__
from app.atlas.charts import Charts
from app.atlas.materials import texel_colours, texture_coordinates
from app.atlas.packing import outlines, pack
from app.atlas.points import bilinear
from app.atlas.seams import Seams
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.bake.glb import GlbBuilder
from app.bake.gltf_materials import MaterialWriter, png_bytes
from app.bake.gltf_writer import add_cameras, add_objects, offset_of, sides_of
from app.bake.own_layout import areas
from app.lightmap.gutter import fill_gutter
from app.scene.model import F32, F64, Scene

MOST_TEXELS = 1 << 22  # of the picture
FINEST = 16.0  # texels of the picture along one of the lightmap


def embedded_glb(scene: Scene, charts: Charts, light: F32, exposure: float) -> bytes:
    """The whole file. light (H, W, 3) f32 [W/m²] over the charts' atlas, with filled gutters; exposure [EV]."""
    fine = _Fine.of(scene, charts, light.shape[0] / charts.size[1])
    picture = np.float32(2.0**exposure) * _sent_out(scene, fine, light.shape[0] / charts.size[1], light)
    glb = GlbBuilder(f"glowtree {__version__}")
    sampler = glb.add("samplers", {"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071})
    image = glb.add_image(png_bytes(picture), "light")
    texture = glb.add("textures", {"source": image, "sampler": sampler, "name": "light"})
    materials = _Shining(glb, scene, texture, 2.0**exposure)
    nodes = add_objects(glb, scene, sides_of(scene, fine.charts), materials, offset_of(scene)) + add_cameras(glb, scene)
    glb.add("scenes", {"name": scene.name, "nodes": nodes})
    glb.document["scene"] = 0
    return glb.to_bytes()


class _Shining(MaterialWriter):
    """Materials that reflect nothing and shine: with the picture where they are lit, by their own emission elsewhere."""

    def __init__(self, glb: GlbBuilder, scene: Scene, picture: int, gain: float) -> None:
        materials = []
        for material in scene.materials:
            red, green, blue = (min(1.0, gain * c) for c in material.emission)
            plain = dataclasses.replace(material, albedo_texture=None, emission_texture=None)
            materials.append(dataclasses.replace(plain, albedo=(0.0, 0.0, 0.0), emission=(red, green, blue)))
        super().__init__(glb, tuple(materials), (), ())
        self._picture = picture

    def _material(self, material: int, double_sided: bool, lit: bool, page: int) -> dict[str, Any]:
        item = super()._material(material, double_sided, False, page)
        if lit:
            item |= {"emissiveFactor": [1.0, 1.0, 1.0], "emissiveTexture": {"index": self._picture, "texCoord": 1}}
        return item


@dataclasses.dataclass(frozen=True, eq=False)
class _Fine:
    """Charts packed anew. Of each, (c, 2) and (c, 1): where it lay (low), by what it grew (scale), where it lies (origin)."""

    charts: Charts
    low: F64
    scale: F64
    origin: F64

    @staticmethod
    def of(scene: Scene, charts: Charts, finer: float) -> _Fine:
        """Each ``finer`` times as fine, or as the textures on it."""
        _, chart = np.unique(charts.face_chart, return_inverse=True)
        charts = dataclasses.replace(charts, face_chart=chart.astype(np.int32), seams=Seams())
        count = int(chart.max(initial=-1)) + 1
        low = np.full((count, 2), np.inf)
        np.minimum.at(low, chart, charts.face_uv.min(axis=1))
        low = np.floor(low)
        scale = _scales(scene, charts, count, finer)[:, None]
        local = (charts.face_uv - low[chart][:, None]) * scale[chart][:, None]
        origin, size = pack(outlines(local, chart.astype(np.int64), count), charts.tile)
        packed = local + origin[chart][:, None]
        none = np.empty((0, 3, 2)), np.empty(0, np.int64)
        anew = dataclasses.replace(charts, size=size, face_uv=packed, hidden_uv=none[0], hidden_face=none[1])
        return _Fine(anew, low, scale, origin.astype(np.float64))


def _scales(scene: Scene, charts: Charts, count: int, finer: float) -> F64:
    """How many times as fine each of the charts becomes (c,), so many that the picture is not too large."""
    area = np.bincount(charts.face_chart, areas(charts.face_uv), count)
    pixels = np.zeros(len(charts.face_triangle))
    for number in np.unique(scene.material_ids):
        texture = scene.materials[number].albedo_texture
        uv = None if texture is None else texture_coordinates(scene, texture)
        if texture is not None and uv is not None:
            mine = scene.material_ids[charts.face_triangle] == number
            extent = np.array(texture.pixels.shape[1::-1]) * (
                1.0 if texture.bilinear else FINEST
            )  # the others have edges
            pixels[mine] = areas(uv[charts.face_triangle[mine]] * extent)
    wanted = np.sqrt(np.bincount(charts.face_chart, pixels, count) / np.maximum(area, 1e-300))
    scale = np.clip(wanted, finer, FINEST * finer)
    plain = float((area * finer**2).sum())
    more = float((area * (scale**2 - finer**2)).sum())
    share = min(1.0, max(MOST_TEXELS - plain, 0.0) / more) if more > 0 else 1.0
    return np.asarray(np.sqrt(finer**2 + share * (scale**2 - finer**2)))


def _sent_out(scene: Scene, fine: _Fine, finer: float, light: F32) -> F32:
    """Radiance (h, w, 3) [W/(sr m²)] over the fine charts' atlas, with filled gutters: light is read there, too, so that it
    goes on across seams as in the lightmap."""
    charts = fine.charts
    leaves = uniform_leaves(charts)
    surfaces = texel_surfaces(scene, charts, leaves)
    there = surfaces.face >= 0
    face = surfaces.face[there]
    material = scene.material_ids[charts.face_triangle[face]]
    albedo, emission = (
        np.array([getattr(m, name) for m in scene.materials], np.float32)[material] for name in ("albedo", "emission")
    )
    painted, shining = texel_colours(scene, charts, leaves, surfaces)
    albedo = albedo if painted is None else albedo * painted[there]
    emission = emission if shining is None else emission * shining[there]
    tile, row, column = np.nonzero(there)
    where = leaves.y[tile] * charts.tile + row, leaves.x[tile] * charts.tile + column
    known = np.zeros(charts.size[::-1], bool)
    known[where] = True
    held = np.zeros((*known.shape, 7), np.float32)
    held[where] = np.column_stack([albedo, emission, 1 + charts.face_chart[face]])
    held = fill_gutter(held, known)
    picture = held[..., 3:6]
    y, x = np.nonzero(held[..., 6])
    chart = held[y, x, 6].astype(np.int64) - 1
    place = (np.column_stack([x, y]) + 0.5 - fine.origin[chart]) / fine.scale[chart] + fine.low[chart]
    picture[y, x] += held[y, x, :3] * (bilinear(light, place * finer) / np.pi).astype(np.float32)
    return picture
