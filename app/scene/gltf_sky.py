"""The sky of a glTF scene: a picture of all directions on the six faces of a cube (EXT_lights_image_based).

Of the pictures only those of mip 0 are read, which hold the radiance itself; the blurred ones and the coefficients of irradiance
follow from them. One is taken for 1 W/(sr m²), as of emissive surfaces. A picture with alpha is RGBD, its colours divided by it.
Each looks as the face does from inside the cube: a texture of OpenGL, flipped about its vertical axis.
"""

from __future__ import annotations

import numpy as np

from app.scene.gltf_file import GltfFile
from app.scene.gltf_materials import image_data
from app.scene.gltf_schema import ImageBasedLight
from app.scene.images import ImageError, read_channel, read_image
from app.scene.model import F32, F64
from app.scene.sky import Sky, directions

FACES = "+X", "-X", "+Y", "-Y", "+Z", "-Z"
MOST_FACE = 512  # px along the edge of a face that all are kept of: a map is four faces wide
# Of each face: the direction of its middle, that to the right of its picture, and that down, from inside
AXES = np.array(
    [
        [(1, 0, 0), (0, 0, 1), (0, -1, 0)],
        [(-1, 0, 0), (0, 0, -1), (0, -1, 0)],
        [(0, 1, 0), (-1, 0, 0), (0, 0, 1)],
        [(0, -1, 0), (-1, 0, 0), (0, 0, -1)],
        [(0, 0, 1), (-1, 0, 0), (0, -1, 0)],
        [(0, 0, -1), (1, 0, 0), (0, -1, 0)],
    ],
    np.float64,
)
SAMPLES = 2  # along each edge of a pixel of the map, so that nothing small is passed over


def read_sky(file: GltfFile) -> Sky | None:
    """The sky of the scene that a file shows; None without one. Raises SceneError."""
    scenes = file.document.scenes
    chosen = file.pick(scenes, file.document.scene, "scene").extensions.image_based if scenes else None
    if chosen is None:
        return None
    light = file.pick(file.document.extensions.image_based.lights, chosen.light, "image-based light")
    name = light.name or f"image-based light {chosen.light}"
    return Sky("image", strength=light.intensity, image=_map(_cube(file, light, name), _turn(light)), name=name)


def _cube(file: GltfFile, light: ImageBasedLight, name: str) -> F32:
    """(6, n, n, 3) radiance on the faces."""
    faces = []
    for face, number in zip(FACES, light.specular_images[0], strict=True):
        data = image_data(file, file.pick(file.document.images, number, "image"))
        try:
            if data is None:
                raise ImageError("there is no such file in the scene's folder")
            pixels, divisor = read_image(data), read_channel(data, "A")
        except ImageError as error:
            raise file.error(f"'{name}', its face {face} is not a readable picture: {error}") from error
        faces.append(pixels if divisor is None else pixels / np.maximum(divisor, np.float32(1 / 255)))
    shapes = {pixels.shape for pixels in faces}
    if len(shapes) > 1 or faces[0].shape[0] != faces[0].shape[1]:
        sizes = ", ".join(f"{width}×{height}" for height, width, _ in sorted(shapes))
        raise file.error(f"'{name}': faces of {sizes} pixels; they must be squares of one size")
    return np.stack(faces)


def _turn(light: ImageBasedLight) -> F64:
    """(3, 3) world from cube."""
    x, y, z, w = np.array(light.rotation) / (np.linalg.norm(light.rotation) or 1.0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _map(cube: F32, world_from_cube: F64) -> F32:
    """(2n, 4n, 3) equirectangular map of the cube's faces (6, n, n, 3), turned."""
    size = min(cube.shape[1], MOST_FACE)
    towards = directions(SAMPLES * 4 * size, SAMPLES * 2 * size) @ world_from_cube
    image = np.zeros((*towards.shape[:2], 3), np.float32)
    axis = np.abs(towards).argmax(-1)
    number = 2 * axis + (np.take_along_axis(towards, axis[..., None], -1)[..., 0] < 0)
    for face, (middle, right, down) in enumerate(AXES):
        mine = number == face
        there = towards[mine] / (towards[mine] @ middle)[:, None]
        image[mine] = _between(cube[face], (there @ right + 1) / 2, (there @ down + 1) / 2)
    return np.ascontiguousarray(image.reshape(2 * size, SAMPLES, 4 * size, SAMPLES, 3).mean((1, 3)))


def _between(pixels: F32, across: F64, down: F64) -> F32:
    """Pixels (n, n, 3) at places from 0 to 1, between their four neighbours."""
    most = len(pixels) - 1
    x, y = (np.clip(place * len(pixels) - 0.5, 0, most) for place in (across, down))
    left, top = (np.minimum(at.astype(np.int64), max(most - 1, 0)) for at in (x, y))
    u, v = (x - left).astype(np.float32)[:, None], (y - top).astype(np.float32)[:, None]
    right, below = np.minimum(left + 1, most), np.minimum(top + 1, most)
    above = pixels[top, left] * (1 - u) + pixels[top, right] * u
    return np.asarray(above * (1 - v) + (pixels[below, left] * (1 - u) + pixels[below, right] * u) * v)


__all__ = ["read_sky"]
