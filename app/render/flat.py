"""A scene as it is seen while it has no light, since it was just read or since nothing in it emits any: in the colours of its
materials, by a lamp at the eye. There is nothing to solve for it, so that it is there as soon as the triangles are."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass
from app.lightmap.tile_pool import SolverSpace
from app.render.camera import CameraView
from app.render.surfaces import uniform_matrix
from app.scene.model import F32, F64, Material, Scene
from app.scene.model import Texture as Picture

POSITION, TINT, MATERIAL, VALUES = slice(0, 3), slice(3, 6), 6, 7
FORMAT = {"in_position": "3f", "in_tint": "3f", "in_material": "1f"}
TABLE_WIDTH = 1024  # materials in a row


@dataclass(frozen=True, eq=False)
class FlatScene:
    """What of a scene is drawn, made in any thread. vertices (n, VALUES): of each its position in solver space, the colour that
    multiplies that of its material, and which that is. indices (m, 3)."""

    scene: Scene
    vertices: F32
    indices: NDArray[np.uint32]
    space: SolverSpace

    @staticmethod
    def of(scene: Scene) -> FlatScene:
        """Triangles share a vertex where they share a corner and what it looks like: its material and its own colour."""
        space, corners = SolverSpace.of(scene), scene.triangles.ravel()
        vertices = np.ones((len(scene.positions), VALUES), np.float32)
        vertices[:, POSITION] = space.local_from_world(scene.positions)
        of_corners = np.repeat(scene.material_ids.astype(np.float32), 3)
        vertices[corners, MATERIAL] = of_corners
        apart = vertices[corners, MATERIAL] != of_corners
        tints = None if scene.colours is None else scene.colours.reshape(-1, 3)
        if tints is not None:
            vertices[corners, TINT] = tints
            apart |= (np.ascontiguousarray(vertices[:, TINT])[corners] != tints).any(1)
        indices = corners.astype(np.uint32)
        which = np.flatnonzero(apart)
        if len(which):
            own = vertices[corners[which]]
            own[:, MATERIAL] = of_corners[which]
            if tints is not None:
                own[:, TINT] = tints[which]
            indices[which] = len(vertices) + np.arange(len(which), dtype=np.uint32)
            vertices = np.concatenate([vertices, own])
        return FlatScene(scene, vertices, indices.reshape(-1, 3), space)

    def same_triangles(self, scene: Scene) -> bool:
        """Whether another scene differs from this one at most in what its materials and lamps are."""
        return len(scene.materials) == len(self.scene.materials) and all(
            getattr(scene, name) is getattr(self.scene, name)
            for name in ("positions", "triangles", "material_ids", "colours")
        )


class FlatMesh:
    """A flat scene on the GPU: surfaces have the mean colours of their materials, also those that are not opaque, and lamps are
    white. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, scene: FlatScene) -> None:
        self.scene, self._pass = scene, Pass(gpu, "render/flat", label="flat")
        self._mesh = Mesh(gpu, scene.vertices.tobytes(), FORMAT, indices=scene.indices.tobytes())
        materials = scene.scene.materials
        self._means: dict[Picture, F64] = {}
        self._colours = gpu.texture((TABLE_WIDTH, -(-len(materials) // TABLE_WIDTH)), 3, "f4")
        self.paint(materials)

    def paint(self, materials: tuple[Material, ...]) -> None:
        """Show these materials from now on, as many as there were."""
        table = np.zeros((*self._colours.size[::-1], 3), np.float32)
        table.reshape(-1, 3)[: len(materials)] = [self._colour(material) for material in materials]
        self._colours.write(table.tobytes())

    def _colour(self, material: Material) -> F64:
        if material.emits:
            return np.ones(3)
        picture = material.albedo_texture
        if picture is None:
            return np.array(material.albedo)
        if picture not in self._means:
            self._means[picture] = picture.pixels.mean((0, 1), dtype=np.float64)
        return np.array(material.albedo) * self._means[picture]

    @functools.cached_property
    def view(self) -> CameraView:
        """Through its camera, which a scene that was read has."""
        camera = self.scene.scene.cameras[0]
        eye = np.asarray(camera.world_from_camera)[:3, 3]
        return CameraView.from_camera(camera, float(np.linalg.norm(eye - self.scene.space.centre)))

    def draw(self, target: Framebuffer, clip_from_local: F64, eye: F64) -> None:
        """Into a target with depth, as a view (4, 4) from a point (3,) [m] shows it."""
        uniforms = {
            "u_clip_from_local": uniform_matrix(clip_from_local),
            "u_eye": tuple(self.scene.space.local_from_world(eye).tolist()),
        }
        self._pass.draw(target, textures={"t_colours": self._colours}, uniforms=uniforms, mesh=self._mesh, depth=True)

    def release(self) -> None:
        self._mesh.release()
        self._colours.release()
