"""Blender's Cycles as a peer: it bakes irradiance into the same charts, in a Python of its own, for its wheel does not go with
the numpy of this one."""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.atlas.charts import Charts
from app.atlas.materials import texture_coordinates
from app.atlas.sides import scene_size
from app.errors import UserError
from app.scene.model import F32, Material, Scene, Texture

PYTHON = "GLOWTREE_BLENDER_PYTHON"  # names a Python that has bpy
WORKER = Path(__file__).with_name("blender_worker.py")
GAP = 1e-5  # of the scene, between the two sheets that a surface with two sides is
LEAST_ALBEDO = 1e-3  # Cycles bakes what is reflected over the albedo, nothing where that is 0
NOT_BAKED = -1.0  # beside the picture
EXTENSIONS = {"repeat": "REPEAT", "clamp": "EXTEND", "mirror": "MIRROR"}


@dataclass(frozen=True, eq=False)
class Baked:
    """irradiance (h, w, 3) [W/m²] of the charts' atlas, row 0 at v = 0; seconds and CPU seconds of the bake; made: by
    which version."""

    irradiance: F32
    seconds: float
    cpu_seconds: float
    made: str


def python() -> str:
    """With which it runs."""
    return os.environ.get(PYTHON) or sys.executable


def no_cycles(module: str | None = None) -> str | None:
    """Why Cycles cannot bake here, None if it can; module: that it needs besides bpy."""
    wheels = ["bpy", *([module] if module else [])]
    if all(_has(python(), wheel) for wheel in wheels):
        return None
    return f"needs a Python with {' and '.join(wheels)}: pip install them in an environment of their own, named by {PYTHON}"


@functools.cache
def _has(python: str, module: str) -> bool:
    """Whether it finds a module."""
    code = f"import importlib.util, sys; sys.exit(importlib.util.find_spec({module!r}) is None)"
    try:
        return subprocess.run([python, "-c", code], capture_output=True).returncode == 0
    except OSError:
        return False


def bake(scene: Scene, charts: Charts, samples: int, *, denoise: bool) -> Baked:
    """With so many samples of each texel. Raises UserError."""
    with tempfile.TemporaryDirectory(prefix="glowtree-") as folder:
        source, target = Path(folder) / "in.npz", Path(folder) / "out.npz"
        np.savez(source, **_described(scene, charts))
        command = [python(), "-P", str(WORKER), str(source), str(target), str(samples), str(int(denoise))]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
        if done.returncode or not target.exists():
            last = (done.stderr.strip() or done.stdout.strip() or f"exit code {done.returncode}").splitlines()[-1]
            raise UserError(f"Cycles: {last}")
        with np.load(target) as found:
            seconds, cpu_seconds = found["seconds"].tolist()
            return Baked(found["irradiance"].astype(np.float32), seconds, cpu_seconds, str(found["made"]))


def _described(scene: Scene, charts: Charts) -> dict[str, Any]:
    """What blender_worker.py reads: a triangle for each side, coordinates with v up. Raises UserError."""
    if scene.colours is not None:
        raise UserError("Cycles is not given vertex colours: compare with another")
    if scene.lit_by_sky:
        raise UserError("Cycles is not given the sky")
    if scene.lit_by_lights:
        raise UserError("Cycles is not given lamps without area")
    double = np.array([m.double_sided for m in scene.materials])[scene.material_ids]
    triangle = np.concatenate([np.arange(len(double)), np.flatnonzero(double)])
    back = np.arange(len(triangle)) >= len(double)
    low, high = scene.bounds
    size = scene_size(scene)
    corners = (scene.corners - (low + high) / 2) / size
    corners = corners[triangle] - GAP * (back[:, None] * scene.normals_areas[0][triangle])[:, None]
    lightmap = np.full((len(triangle), 3, 2), NOT_BAKED)
    place = np.zeros((2, len(double)), np.int64)
    place[0], place[1, np.flatnonzero(double)] = np.arange(len(double)), np.arange(len(double), len(triangle))
    lightmap[place[charts.face_back.astype(int), charts.face_triangle]] = charts.face_uv / np.array(charts.size)
    arrays: dict[str, Any] = {"size": np.array(charts.size), "material": scene.material_ids[triangle]}
    materials = []
    for k, material in enumerate(scene.materials):
        item, textures = _material(material)
        materials.append(item)
        arrays |= {f"{kind}_{k}": pixels for kind, pixels in textures.items()}
    uv = {kind: _texcoords(scene, kind)[triangle] for kind in ("albedo", "emission")} | {"lightmap": lightmap}
    corners[back] = corners[back][:, ::-1]
    for name, coordinates in uv.items():
        coordinates[back] = coordinates[back][:, ::-1]
        arrays[f"uv_{name}"] = coordinates
    return arrays | {"corners": corners, "materials": np.array(json.dumps(materials))}


def _material(material: Material) -> tuple[dict[str, Any], dict[str, F32]]:
    """As JSON, and its pictures times their factors. Raises UserError."""
    item: dict[str, Any] = {"emits": material.emits, "emission": material.emission}
    item["albedo"] = np.maximum(material.albedo, LEAST_ALBEDO).tolist()
    pictures = {}
    for kind, texture in (("albedo", material.albedo_texture), ("emission", material.emission_texture)):
        if texture is not None and (kind == "albedo" or material.emits):
            item[f"{kind}_look_up"] = _look_up(texture)
            pictures[kind] = (texture.pixels * np.array(getattr(material, kind))).astype(np.float32)
    if "albedo" in pictures:
        pictures["albedo"] = np.maximum(pictures["albedo"], np.float32(LEAST_ALBEDO))
    return item, pictures


def _look_up(texture: Texture) -> tuple[str, str]:
    """Blender's names. Raises UserError."""
    if texture.wrap[0] != texture.wrap[1]:
        raise UserError(f"texture {texture.name}: Blender repeats along u as along v, not {' and '.join(texture.wrap)}")
    return "Linear" if texture.bilinear else "Closest", EXTENSIONS[texture.wrap[0]]


def _texcoords(scene: Scene, kind: str) -> np.ndarray:
    """(m, 3, 2) of each triangle's texture, v up."""
    out = np.zeros((len(scene.triangles), 3, 2))
    for k, material in enumerate(scene.materials):
        texture: Texture | None = getattr(material, f"{kind}_texture")
        coordinates = None if texture is None else texture_coordinates(scene, texture)
        if coordinates is not None:
            mine = scene.material_ids == k
            out[mine] = coordinates[mine]
    out[..., 1] = 1 - out[..., 1]
    return out
