"""The triangles whose materials have textures or whose corners have colours, a mesh for each material, and those textures with
mip-maps.

They are drawn over the same triangles as display texels show them, at equal depth: a pixel then has the albedo and the emission
of the texture where it is, and of the texels only the light. What is blended stays as sharp as its texels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.materials import texture_coordinates
from app.atlas.visible_mesh import VERTEX, VERTEX_FORMAT
from app.gpu import Gpu, Mesh, Texture
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, Material, Scene
from app.scene.model import Texture as Picture

TEXTURED = np.dtype([*VERTEX.descr, ("in_albedo_uv", "f4", 2), ("in_emission_uv", "f4", 2), ("in_colour", "f4", 3)])
TEXTURED_FORMAT = VERTEX_FORMAT | {"in_albedo_uv": "2f", "in_emission_uv": "2f", "in_colour": "3f"}
KINDS = {"albedo": "t_albedo_picture", "emission": "t_emission_picture"}


class TexturedMesh:
    """Whoever makes it releases it. batches: number of a material, its triangles, its textures by name."""

    def __init__(self, gpu: Gpu, pool: TilePool, materials: list[int]) -> None:
        self._gpu = gpu
        self._pictures: dict[tuple[object, ...], Texture] = {}
        drawn = pool.visible_mesh
        self.batches: list[tuple[int, Mesh, dict[str, Texture]]] = []
        for number in materials:
            triangles = np.flatnonzero(pool.scene.material_ids == number)
            rows, _ = drawn.rows_of(triangles)
            vertices: Any = np.zeros((len(rows), 3), TEXTURED)
            shared: Any = drawn.vertices[drawn.corners[rows]]
            for name in VERTEX_FORMAT:
                vertices[name] = shared[name]
            colours = pool.scene.colours
            vertices["in_colour"] = 1.0 if colours is None else drawn.at_corners(rows, colours)
            pictures = {}
            for kind, name in KINDS.items():
                pictures[name] = self._fill(vertices, pool, rows, kind)
            order = np.arange(vertices.size, dtype=np.uint32)
            mesh = Mesh(gpu, vertices.tobytes(), TEXTURED_FORMAT, indices=order.tobytes())
            self.batches.append((number, mesh, pictures))

    def _fill(self, vertices: Any, pool: TilePool, rows: NDArray[np.int64], kind: str) -> Texture:
        """Write where in the texture of this kind the corners lie; the texture, of one white pixel where there is none."""
        scene, drawn = pool.scene, pool.visible_mesh
        material = scene.materials[scene.material_ids[drawn.triangle[rows[0]]]]
        picture: Picture | None = getattr(material, f"{kind}_texture")
        coordinates = None if picture is None else texture_coordinates(scene, picture)
        if picture is None or coordinates is None:
            return self._uploaded(np.ones((1, 1, 3), np.float32), ("repeat", "repeat"), bilinear=True, key=())
        mirrors = np.array([2 if wrap == "mirror" else 1 for wrap in picture.wrap])
        vertices[f"in_{kind}_uv"] = drawn.at_corners(rows, coordinates) / mirrors
        key = id(picture.pixels), picture.wrap, picture.bilinear
        return self._uploaded(picture.pixels, picture.wrap, bilinear=picture.bilinear, key=key)

    def _uploaded(self, pixels: F32, wrap: tuple[str, str], *, bilinear: bool, key: tuple[object, ...]) -> Texture:
        """One that mirrors is held with its mirror image, and repeats."""
        if key not in self._pictures:
            for axis, how in ((1, wrap[0]), (0, wrap[1])):
                pixels = np.concatenate([pixels, np.flip(pixels, axis)], axis) if how == "mirror" else pixels
            height, width = pixels.shape[:2]
            texture = self._gpu.texture((width, height), 3, "f2", pixels.astype(np.float16).tobytes())
            texture.build_mipmaps()
            ctx = self._gpu.ctx
            texture.filter = (
                ctx.LINEAR_MIPMAP_LINEAR if bilinear else ctx.NEAREST_MIPMAP_LINEAR,
                ctx.LINEAR if bilinear else ctx.NEAREST,
            )
            texture.repeat_x, texture.repeat_y = (how != "clamp" for how in wrap)
            self._pictures[key] = texture
        return self._pictures[key]

    def release(self) -> None:
        self._gpu.release_all(*self._pictures.values())
        for _, mesh, _ in self.batches:
            mesh.release()


def textured_materials(scene: Scene) -> list[int]:
    """Numbers of those that are used, not blended, and have a picture or colours to show."""
    return [int(m) for m in np.unique(scene.material_ids) if _is_textured(scene, scene.materials[m])]


def _is_textured(scene: Scene, material: Material) -> bool:
    pictures = (material.albedo_texture, material.emission_texture)
    shows = any(p is not None and texture_coordinates(scene, p) is not None for p in pictures)
    return (material.opaque or material.opacity_cutoff is not None) and (shows or scene.colours is not None)
