"""A scene as it is seen while it has no light, since it was just read or since nothing in it emits any: in the colours of its
materials, by a lamp at the eye. There is nothing to solve for it, so that it is there as soon as the triangles are."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from app.gpu import Framebuffer, Gpu, Mesh, Pass
from app.lightmap.tile_pool import SolverSpace
from app.render.camera import CameraView
from app.render.surfaces import uniform_matrix
from app.scene.model import F64, RGB, Camera, Material, Scene
from app.scene.model import Texture as Picture

VERTEX = np.dtype([("in_position", "f4", 3), ("in_colour", "f4", 3)])
FORMAT = {"in_position": "3f", "in_colour": "3f"}


@dataclass(frozen=True, eq=False)
class FlatScene:
    """What of a scene is drawn, made in any thread: vertices (n,) VERTEX, indices (m, 3) u32; camera: the one to look through,
    None where the scene has none."""

    vertices: np.ndarray[tuple[int], np.dtype[np.void]]
    indices: np.ndarray[tuple[int, int], np.dtype[np.uint32]]
    space: SolverSpace
    camera: Camera | None

    @staticmethod
    def of(scene: Scene) -> FlatScene:
        """Corners have the mean colour of the material, times their own; lamps are white."""
        space = SolverSpace.of(scene)
        vertices = np.zeros(len(scene.positions), VERTEX)
        vertices["in_position"] = space.local_from_world(scene.positions)
        colours = np.array([_colour(material) for material in scene.materials])[scene.material_ids][:, None]
        corners = np.broadcast_to(colours, (len(scene.triangles), 3, 3))
        vertices["in_colour"][scene.triangles] = corners if scene.colours is None else corners * scene.colours
        return FlatScene(vertices, scene.triangles.astype(np.uint32), space, next(iter(scene.cameras), None))


class FlatMesh:
    """A flat scene on the GPU. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, scene: FlatScene) -> None:
        self.scene, self._pass = scene, Pass(gpu, "render/flat", label="flat")
        self._mesh = Mesh(gpu, scene.vertices.tobytes(), FORMAT, indices=scene.indices.tobytes())

    @functools.cached_property
    def view(self) -> CameraView:
        """Through its camera, which a scene that was read has."""
        camera = self.scene.camera
        assert camera is not None
        eye = np.asarray(camera.world_from_camera)[:3, 3]
        return CameraView.from_camera(camera, float(np.linalg.norm(eye - self.scene.space.centre)))

    def draw(self, target: Framebuffer, clip_from_local: F64, eye: F64) -> None:
        """Into a target with depth, as a view (4, 4) from a point (3,) [m] shows it."""
        uniforms = {
            "u_clip_from_local": uniform_matrix(clip_from_local),
            "u_eye": tuple(self.scene.space.local_from_world(eye).tolist()),
        }
        self._pass.draw(target, uniforms=uniforms, mesh=self._mesh, depth=True)

    def release(self) -> None:
        self._mesh.release()


def _colour(material: Material) -> RGB:
    if material.emits:
        return 1.0, 1.0, 1.0
    picture: Picture | None = material.albedo_texture
    mean = np.ones(3) if picture is None else picture.pixels.mean((0, 1))
    red, green, blue = (np.array(material.albedo) * mean).tolist()
    return red, green, blue
