"""Textures as arrays that are kept, and taken over again."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from app.util.state import State

DTYPES: dict[str, type[np.generic]] = {"f4": np.float32, "f2": np.float16, "f1": np.uint8, "u4": np.uint32}


def keep(state: State, **textures: moderngl.Texture) -> None:
    """What these textures hold, (height, width, components) each, under their names. Waits for the GPU."""
    for name, texture in textures.items():
        state.arrays[name] = texture_array(texture)


def take_over(state: State, **textures: moderngl.Texture) -> None:
    """Let these textures hold what was kept. Raises StateError where that is of another size or type."""
    for name, texture in textures.items():
        array = state.array(name, DTYPES[texture.dtype], *texture.size[::-1], texture.components)
        texture.write(np.ascontiguousarray(array).tobytes())


def texture_array(texture: moderngl.Texture) -> NDArray[Any]:
    """(height, width, components). Waits for the GPU."""
    array = np.frombuffer(texture.read(), DTYPES[texture.dtype])
    return array.reshape(*texture.size[::-1], texture.components)


__all__ = ["keep", "take_over", "texture_array"]
