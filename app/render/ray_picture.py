"""The rays of a texel: as lines in the room, and as a picture of the hemisphere above it, in the colours of what they bring.

The hemisphere is projected onto the plane of its texel: light counts there as the cosine, so that equal areas bring equal light
(Nusselt's analogue), and rays that are distributed as the cosine are as dense everywhere.
"""

from __future__ import annotations

import numpy as np

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.render.options import DisplayOptions
from app.render.tone_mapping import curve
from app.scene.model import F32, F64

LINES = 128  # that are drawn: more hide each other
LINE_PX, SEAM_PX = 1.25, 0.75  # width, and that of the seams on both sides
CELL = 2.4  # reach of a cell, of the distance between rays that are evenly spread; a gap of more stays empty
EDGE_PX = 384  # of the picture
STEEP = 0.9  # cosine to the vertical from which a surface has no upright in its picture


class RayPicture:
    """Rays as they were given last; none at first. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._lines: Mesh | None = None
        self._cells: Mesh | None = None
        self._image: tuple[Texture, Texture, Framebuffer] | None = None

    def show(self, start: F32, end: F32, light: F32, normal: F64, right: F64) -> None:
        """Other rays: start, end (n, 3) [solver space], radiance that each brings (n, 3), normal (3,) of their surface;
        right (3,) of who looks."""
        self.forget()
        if not len(start):
            return
        rows = np.concatenate([start, end, light], 1).astype(np.float32)
        self._lines = _instances(self._gpu, rows[:LINES], {"in_start": "3f", "in_end": "3f", "in_light": "3f"})
        direction = (end - start) / np.maximum(np.linalg.norm(end - start, axis=1, keepdims=True), 1e-30)
        place = direction @ np.stack(_axes(normal, right), 1)
        cells = np.concatenate([place, light], 1).astype(np.float32)
        self._cells = _instances(self._gpu, cells, {"in_place": "2f", "in_light": "3f"})

    def draw(
        self, target: Framebuffer, clip_from_local: F64, size: tuple[int, int], display: DisplayOptions, *, linear: bool
    ) -> None:
        """The lines, in a target with depth of that size [px]. linear: as light, not developed for the screen."""
        if self._lines is None:
            return
        shader, uniforms = curve(display, None, exposed=True)
        slots = {"curve": f"render/{shader}.glsl"}
        how = Pass(self._gpu, "render/ray_lines", slots=slots, defines={"LINEAR": linear})
        target.depth_mask = False
        how.draw(
            target,
            uniforms=uniforms
            | {
                "u_clip_from_local": tuple(clip_from_local.T.ravel().tolist()),
                "u_size_px": (float(size[0]), float(size[1])),
                "u_width_px": LINE_PX,
                "u_seam_px": SEAM_PX,
            },
            mesh=self._lines,
            blend="over",
            depth=True,
        )
        target.depth_mask = True

    def hemisphere(self, display: DisplayOptions) -> Texture | None:
        """An RGBA8 picture of all rays, empty around the disc; None without any. It is the same texture every time."""
        if self._cells is None:
            return None
        if self._image is None:
            colour, depth = self._gpu.texture((EDGE_PX, EDGE_PX), 4, "f1"), self._gpu.depth_texture((EDGE_PX, EDGE_PX))
            colour.filter = (self._gpu.ctx.LINEAR, self._gpu.ctx.LINEAR)
            self._image = colour, depth, self._gpu.target(colour, depth=depth)
        colour, _, target = self._image
        target.clear(depth=1.0)
        shader, uniforms = curve(display, None, exposed=True)
        how = Pass(self._gpu, "render/hemisphere", slots={"curve": f"render/{shader}.glsl"})
        reach = CELL * float(np.sqrt(np.pi / self._cells.count))
        how.draw(target, uniforms=uniforms | {"u_reach": reach}, mesh=self._cells, depth=True)
        return colour

    def forget(self) -> None:
        """No rays."""
        for mesh in (self._lines, self._cells):
            if mesh is not None:
                mesh.release()
        self._lines = self._cells = None

    def release(self) -> None:
        self.forget()
        if self._image is not None:
            self._gpu.release_all(*self._image)
            self._image = None


def _instances(gpu: Gpu, rows: F32, attributes: dict[str, str]) -> Mesh:
    return Mesh(gpu, np.ascontiguousarray(rows).tobytes(), attributes, per_instance=True)


def _axes(normal: F64, right: F64) -> tuple[F64, F64]:
    """Right and up in the picture of somebody who stands on the surface and looks along its normal. The world's up is up; on
    floors and ceilings right is what it is for who looks."""
    upright = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < STEEP else np.cross(right, normal)
    up = upright - normal * (upright @ normal)
    up /= np.linalg.norm(up)
    return np.cross(normal, up), up
