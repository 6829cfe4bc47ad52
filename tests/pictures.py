"""What tests of the picture compare with: tone curves in float64, rays, and a picture of a lightmap in one call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.units import LUMINANCE
from app.scene.model import F64


def framing(lower: F64, upper: F64) -> CameraView:
    """The box between two corners [m], seen from 25 degrees to the right and 15 above."""
    view = CameraView(np.eye(4), float(np.radians(40.0)), 1.0)
    view.orbit(np.radians(25.0), np.radians(15.0))
    view.focus((lower + upper) / 2, float(np.linalg.norm(upper - lower)) / 2)
    return view


def ray(view: CameraView, x_ndc: float, y_ndc: float, aspect: float) -> tuple[F64, F64]:
    """Origin (3,) [m] and unit direction (3,) in the world through a point of the picture (-1 to 1, +y up)."""
    tangent = np.tan(view.yfov / 2)
    direction = view.world_from_camera[:3, :3] @ np.array([x_ndc * aspect * tangent, y_ndc * tangent, -1.0])
    return view.eye.copy(), direction / np.linalg.norm(direction)


def render_image(
    gpu: Gpu, lightmap: Lightmap, view: CameraView, display: DisplayOptions, size: tuple[int, int], **more: Any
) -> NDArray[np.uint8]:
    """One picture of ``size`` (width, height): (height, width, 3) u8 sRGB, top row first."""
    colour = gpu.texture(size, 4, "f1")
    target = gpu.target(colour)
    renderer = FrameRenderer(gpu)
    try:
        renderer.render(target, size, lightmap, view, display, **more)
        pixels = np.frombuffer(colour.read(), np.uint8).reshape(size[1], size[0], 4)
    finally:
        renderer.release()
        gpu.release_all(target, colour)
    return np.ascontiguousarray(pixels[::-1, :, :3])


def tone_map(name: str, rgb: F64) -> F64:
    """Exposed linear Rec.709 (…, 3) to linear Rec.709 of the screen in [0, 1], by a curve of TONE_MAPS."""
    return np.clip(CURVES[name](np.asarray(rgb, np.float64)), 0.0, 1.0)


def _clamp(rgb: F64) -> F64:
    return rgb


def _reinhard(rgb: F64) -> F64:
    """L / (1 + L) on luminance [Reinhard02, equation 3]."""
    return np.asarray(rgb / (1 + rgb @ LUMINANCE)[..., None])


def _aces(rgb: F64) -> F64:
    """Stephen Hill's fit of the ACES transforms, brightened by 1/0.6 as in three.js."""
    rrt = np.array([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]])
    odt = np.array([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]])
    v = np.minimum(rgb / 0.6, 1e6) @ rrt.T
    fit: F64 = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    return np.asarray(fit @ odt.T)


def _agx(rgb: F64) -> F64:
    """Troy Sobotka's AgX as in Filament and three.js."""
    rec2020 = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0113], [0.0164, 0.0880, 0.8956]])
    rec709 = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
    inset = np.array(
        [
            [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
            [0.137318972929847, 0.761241990602591, 0.101439036467562],
            [0.11189821299995, 0.0767994186031903, 0.811302368396859],
        ]
    )
    outset = np.array(
        [
            [1.1271005818144368, -0.11060664309660323, -0.016493938717834573],
            [-0.1413297634984383, 1.157823702216272, -0.016493938717834257],
            [-0.14132976349843826, -0.11060664309660294, 1.2519364065950405],
        ]
    )
    darkest_ev, brightest_ev = -12.47393, 4.026069
    stops = np.log2(np.maximum(rgb @ rec2020.T @ inset.T, 1e-10))
    x = np.clip((stops - darkest_ev) / (brightest_ev - darkest_ev), 0, 1)
    curve = np.polyval([15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232], x)
    return np.asarray(np.maximum(curve @ outset.T, 0) ** 2.2 @ rec709.T)


def _neutral(rgb: F64) -> F64:
    """Khronos PBR Neutral."""
    start, desaturation = 0.8 - 0.04, 0.15
    low = rgb.min(-1, keepdims=True)
    rgb = rgb - np.where(low < 0.08, low - 6.25 * low * low, 0.04)
    peak = rgb.max(-1, keepdims=True)
    room = 1 - start
    new_peak = 1 - room**2 / (np.maximum(peak, start) + room - start)
    whitened = 1 - 1 / (desaturation * (np.maximum(peak, start) - new_peak) + 1)
    compressed = rgb * (new_peak / np.maximum(peak, start)) * (1 - whitened) + new_peak * whitened
    return np.asarray(np.where(peak < start, rgb, compressed))


CURVES: dict[str, Callable[[F64], F64]] = {
    "clamp": _clamp,
    "reinhard": _reinhard,
    "aces": _aces,
    "agx": _agx,
    "neutral": _neutral,
}
