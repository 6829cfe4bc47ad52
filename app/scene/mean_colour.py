"""The mean of what multiplies a material's albedo: of its picture and of the colours of its corners."""

from __future__ import annotations

import numpy as np

from app.scene.model import RGB, Scene

MOST_PIXELS = 1 << 16  # of a picture, that its mean is taken of


def mean_factor(scene: Scene, index: int) -> RGB:
    """Linear Rec.709, the mean over a picture times that over the corners of the material's triangles; 1 where it has neither."""
    mean = np.ones(3)
    picture = scene.materials[index].albedo_texture
    if picture is not None:
        step = int(np.ceil(np.sqrt(max(picture.pixels.shape[0] * picture.pixels.shape[1] / MOST_PIXELS, 1.0))))
        mean *= picture.pixels[::step, ::step].mean(axis=(0, 1), dtype=np.float64)
    chosen = scene.material_ids == index
    if scene.colours is not None and chosen.any():
        mean *= np.average(
            scene.colours[chosen].mean(axis=1, dtype=np.float64), axis=0, weights=scene.normals_areas[1][chosen]
        )
    red, green, blue = mean.tolist()
    return red, green, blue


__all__ = ["mean_factor"]
