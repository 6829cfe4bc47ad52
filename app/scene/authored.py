"""Scenes written by hand as TOML. Unknown keys are errors; an error names file, key and reason.

    [scene]                     # name; unit = "m" | "cm" | "mm" | "in" | "ft": what every length below is
                                # counted in, also in .obj, .ply and .stl files; exposure = 0, EV by which its picture
                                # is brighter than the automatic exposure has it, below 0 as for a night
    [[material]]                # name; albedo = [r, g, b]; double_sided = false; opacity = 1: light passes by 1 - opacity
                                # lightmap_scale = 1: so many times the texels along a metre, 1/16 to 16
                                # emission = [r, g, b] radiance L [W/(sr m²)], or exitance = [r, g, b] πL [W/m²]
                                # texture = { pattern = "checker" | "stripes", colors = [[r, g, b], [r, g, b]] }
                                #        or { image = "file beside the TOML" }, both with repeat = [across, up]
    [[quad]]                    # material; origin, edge_u, edge_v, facing along u × v; or corners = [4 points],
                                # counter-clockwise from the front; name
    [[box]]                     # material; center, size; rotate_y = degrees; inside = true faces inwards;
                                # without = ["bottom", ...] of left right bottom top back front; name
    [[mesh]]                    # file beside the TOML (.glb .gltf .obj .ply .stl); translate, rotate = degrees about
                                # x, then y, then z, scale = number or [x, y, z]; material to replace its own; name
    [[procedural]]              # kind = "museum" | "grotto" | "village" | "icosphere" | "cylinder" and parameters:
                                # procedural.py
    [[camera]]                  # name; position, target; yfov_deg = 45
    [[light]]                   # a lamp without area: kind = "point" | "spot" | "directional"; intensity = [r, g, b] [W/sr], of
                                # a directional one irradiance [W/m²]; position; direction or target; inner_deg = 0 and
                                # outer_deg = 45 of a spot's cones; range; radius, or angle_deg of a directional one: of what
                                # makes soft shadows; name
    [sky]                       # kind = "uniform" | "clear" | "image"; colour = [r, g, b] radiance L [W/(sr m²)] of a uniform
                                # one, multiplies the others, and their sun; strength = 1; turbidity = 2.5, of clear air
                                # sun = { azimuth = degrees from north, -z, over east, +x, height = degrees }
                                #    or { time = 2026-06-21T18:30:00+02:00, latitude = degrees north, longitude = degrees east }
                                # file = "map.hdr" beside the TOML (.hdr .exr), rotate = degrees, of an image

Colours are linear Rec.709, or one number for grey. A texture multiplies the albedo, which is then 1 unless given; it
fills each quad and each face of a box, ``repeat`` times. +y is up.
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from app.errors import SceneError
from app.scene import shapes
from app.scene.authored_tables import LightTable, MaterialTable, MeshTable, SceneFile, SkyTable, TextureTable
from app.scene.cameras import look_at
from app.scene.gltf import load_gltf
from app.scene.gltf_file import first_problem
from app.scene.gltf_pose import turned_normals
from app.scene.images import ImageError, path_inside, read_image
from app.scene.lights import Light
from app.scene.meshfile import load_meshfile
from app.scene.model import Camera, Material, Scene, Texture
from app.scene.options import UNITS
from app.scene.orientation import WITHOUT_UNIT
from app.scene.sky import Sky
from app.scene.sky_image import SUFFIXES, read_sky_image
from app.scene.validate import Part, validate
from app.util.background import Report, share_of, unheard

MESH_LOADERS = {
    ".glb": load_gltf,
    ".gltf": load_gltf,
    ".obj": load_meshfile,
    ".ply": load_meshfile,
    ".stl": load_meshfile,
}


@np.errstate(all="ignore")
def load_authored(path: Path, report: Report = unheard) -> Scene:
    """Read a .toml scene. report(share) is called now and then and may raise to cancel. SceneError names the file, the key and
    the reason."""
    try:
        table = SceneFile.model_validate(tomllib.loads(path.read_text("utf-8")))
    except OSError as error:
        raise SceneError(path, f"cannot be read: {error.strerror}") from error
    except ValidationError as error:  # before ValueError, which it is
        raise SceneError(path, first_problem(error)) from error
    except (ValueError, RecursionError) as error:  # not TOML, or not UTF-8
        raise SceneError(path, f"not TOML: {' '.join(str(error).split())}") from error
    return _Builder(path, table).scene(report)


class _Builder:
    """Turns checked tables into parts, one object each."""

    def __init__(self, path: Path, table: SceneFile) -> None:
        self.path = path
        self.table = table
        self.unit = UNITS[table.scene.unit]
        self.parts: list[Part] = []
        self.objects: list[str] = []
        self.cameras: list[Camera] = []
        self.lights: list[Light] = []
        self.warnings: list[str] = []
        self.materials = [self._material(i, m) for i, m in enumerate(table.material)]
        self.ids = {m.name: i for i, m in enumerate(table.material)}
        if len(self.ids) < len(table.material):
            raise SceneError(path, "material: two materials have the same name")

    def scene(self, report: Report) -> Scene:
        for i, quad in enumerate(self.table.quad):
            self._add(quad.name or f"quad {i + 1}", self._id(quad.material, f"quad.{i}"), quad.mesh())
        for i, box in enumerate(self.table.box):
            self._add(box.name or f"box {i + 1}", self._id(box.material, f"box.{i}"), box.mesh())
        for i, generator in enumerate(self.table.procedural):
            for name, material, mesh in generator.pieces():
                self._add(name, self._id(material, f"procedural.{i}"), mesh)
        for i, mesh_table in enumerate(self.table.mesh):
            files = len(self.table.mesh)
            self._add_file(mesh_table, f"mesh.{i}", share_of(report, 0.5 * i / files, 0.5 * (i + 1) / files))
        for camera in self.table.camera:
            eye, target = (self.unit * np.array(p) for p in (camera.position, camera.target))
            self.cameras.append(Camera(camera.name, look_at(eye, target), math.radians(camera.yfov_deg)))
        self.lights += [self._light(i, light) for i, light in enumerate(self.table.light)]
        name = self.table.scene.name or self.path.stem
        given = self.parts, self.objects, self.materials, self.cameras, self.warnings, self.lights
        scene = validate(self.path, name, *given, share_of(report, 0.5, 1.0))
        scene = dataclasses.replace(scene, exposure=self.table.scene.exposure)
        return scene if self.table.sky is None else scene.with_sky(self._sky(self.table.sky))

    def _id(self, material: str, where: str) -> int:
        if material not in self.ids:
            known = ", ".join(self.ids) or "none"
            raise SceneError(self.path, f"{where}: there is no material '{material}' (materials: {known})")
        return self.ids[material]

    def _material(self, index: int, table: MaterialTable) -> Material:
        light = table.emission or (0.0, 0.0, 0.0)
        if table.exitance is not None:
            r, g, b = table.exitance
            light = (r / math.pi, g / math.pi, b / math.pi)
        texture = None if table.texture is None else self._texture(f"material.{index}.texture", table.texture)
        albedo = table.albedo or ((0.5, 0.5, 0.5) if texture is None else (1.0, 1.0, 1.0))
        return Material(
            table.name,
            albedo,
            light,
            texture,
            double_sided=table.double_sided,
            opacity=table.opacity,
            lightmap_scale=table.lightmap_scale,
        )

    def _texture(self, where: str, table: TextureTable) -> Texture:
        scale = np.diag([*table.repeat, 1.0])[:2]
        if table.image is None:
            assert table.pattern is not None and table.colors is not None
            a, b = table.colors
            rows = [[a, b], [b, a]] if table.pattern == "checker" else [[a, b]]
            return Texture(table.pattern, np.array(rows, np.float32), bilinear=False, uv_transform=scale)
        found = path_inside(self.path.parent, table.image)
        if found is None:
            raise SceneError(self.path, f"{where}: there is no picture '{table.image}' in the scene's folder")
        try:
            return Texture(table.image, read_image(found), uv_transform=scale)
        except ImageError as error:
            raise SceneError(self.path, f"{where}: '{table.image}' is not a readable picture: {error}") from error

    def _light(self, index: int, table: LightTable) -> Light:
        x, y, z = (self.unit * p for p in table.position or (0.0, 0.0, 0.0))
        u, v, w = (c / math.hypot(*table.aim) for c in table.aim)
        return Light(
            table.name or f"light {index + 1}",
            table.kind,
            table.intensity,
            (x, y, z),
            (u, v, w),
            math.radians(table.inner_deg),
            math.radians(table.outer_deg),
            math.inf if table.range is None else self.unit * table.range,
            self.unit * table.radius,
            math.radians(table.angle_deg),
        )

    def _sky(self, table: SkyTable) -> Sky:
        image = None
        if table.file is not None:
            found = path_inside(self.path.parent, table.file)
            if found is None:
                raise SceneError(self.path, f"sky.file: there is no file '{table.file}' in the scene's folder")
            if found.suffix.lower() not in SUFFIXES:
                raise SceneError(self.path, f"sky.file: '{table.file}' is none of {', '.join(SUFFIXES)}")
            try:
                image = read_sky_image(found)
            except ImageError as error:
                raise SceneError(self.path, f"sky.file: '{table.file}' is not a readable sky: {error}") from error
        sun = None if table.sun is None else table.sun.sun
        name = table.file or ""
        return Sky(table.kind, table.colour, table.strength, sun, table.turbidity, image, table.rotate, name)

    def _add(self, name: str, material: int, mesh: shapes.Mesh) -> None:
        self.parts.append(Part(mesh.positions * self.unit, mesh.triangles, len(self.objects), material, uv0=mesh.uv))
        self.objects.append(name)

    def _add_file(self, table: MeshTable, where: str, report: Report) -> None:
        """A mesh file's triangles with their own materials, or all with the one that is named."""
        found = path_inside(self.path.parent, table.file)
        if found is None:
            raise SceneError(self.path, f"{where}.file: there is no file '{table.file}' in the scene's folder")
        if found.suffix.lower() not in MESH_LOADERS:
            allowed = ", ".join(MESH_LOADERS)
            raise SceneError(self.path, f"{where}.file: '{table.file}' is none of {allowed}")
        part = MESH_LOADERS[found.suffix.lower()](found, report)
        matrix = shapes.transform(np.array(table.translate) * self.unit, table.rotate, table.scale)
        unit = self.unit if found.suffix.lower() in WITHOUT_UNIT else 1.0
        positions = unit * part.positions @ matrix[:3, :3].T + matrix[:3, 3]
        order = [0, 2, 1] if np.linalg.det(matrix[:3, :3]) < 0.0 else [0, 1, 2]
        material_ids = part.material_ids + len(self.materials)
        if table.material is not None:
            material_ids = np.full(len(part.triangles), self._id(table.material, f"{where}.material"))
        else:
            own = MESH_LOADERS[found.suffix.lower()] is load_gltf
            self.materials += [
                dataclasses.replace(m, gltf=(found, k)) if own else m for k, m in enumerate(part.materials)
            ]
        prefix = f"{table.name}: " if table.name else ""
        self.parts.append(
            Part(
                positions,
                part.triangles[:, order],
                part.object_ids + len(self.objects),
                material_ids,
                None if part.uv0 is None else part.uv0[:, order],
                None if part.uv1 is None else part.uv1[:, order],
                normals=None if part.normals is None else turned_normals(matrix[:3, :3], part.normals)[:, order],
                colours=None if part.colours is None else part.colours[:, order],
            )
        )
        self.objects += [prefix + name for name in part.objects]
        for light in part.lights:
            x, y, z = (matrix[:3, :3] @ np.array(light.position) + matrix[:3, 3]).tolist()
            turned = matrix[:3, :3] @ np.array(light.direction)
            u, v, w = (turned / np.linalg.norm(turned)).tolist()
            name = prefix + light.name
            self.lights.append(dataclasses.replace(light, name=name, position=(x, y, z), direction=(u, v, w)))
        if part.sky is not None:
            self.warnings.append(f"{table.file}: its sky is left out: [sky] gives one")
        self.warnings += [f"{table.file}: {note}" for note in part.warnings]
