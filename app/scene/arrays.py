"""A scene as named arrays: what a digest of it is made from."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.scene.model import Scene


def arrays_of(scene: Scene) -> dict[str, NDArray[Any]]:
    """All of a scene that light depends on, by name; cameras, names and order of its objects are not. But which sides have texels
    also depends on cameras: see app/atlas/enclosed.py."""
    arrays: dict[str, NDArray[Any]] = {"corners": scene.corners, "material_ids": scene.material_ids}
    for name, values in (("uv0", scene.uv0), ("uv1", scene.uv1), ("colours", scene.colours)):
        if values is not None:
            arrays[name] = values
    for k, material in enumerate(scene.materials):
        arrays[f"material {k}"] = np.array([*material.albedo, *material.emission, material.double_sided])
        if not material.opaque:
            arrays[f"opacity {k}"] = np.array(
                [material.opacity, -1 if material.opacity_cutoff is None else material.opacity_cutoff]
            )
        textures = {
            "albedo": material.albedo_texture,
            "emission": material.emission_texture,
            "cut-out": material.opacity_texture,
        }
        for kind, texture in textures.items():
            if texture is not None:
                arrays[f"{kind} {k} {texture.wrap} {texture.bilinear} {texture.texcoord}"] = texture.pixels
                arrays[f"{kind} {k} transform"] = texture.uv_transform
    if scene.sky is not None:
        arrays["sky"] = scene.sky.radiance
        if scene.sky.sun is not None:
            arrays["sun"] = np.concatenate([scene.sky.sun.direction, scene.sky.sun_irradiance])
    for k, light in enumerate(scene.lights):
        places = (*light.position, *light.direction, light.inner, light.outer, light.range, light.radius, light.angle)
        arrays[f"light {k} {light.kind}"] = np.array([*light.intensity, *places, light.on])
    return arrays
