"""The eye: a pinhole that orbits and flies, x_clip = P · R⁻¹ · (x − eye), in metres with +y up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.lightmap.tile_pool import SolverSpace
from app.scene.model import F64, Camera

POLE = np.radians(89.5)  # orbiting stops short of straight up and down
NEAREST = 0.02  # near plane, in scene radii or target distances: what is closer is clamped to it, not cut (frame.py)
FAR_MARGIN = 1.01  # the scene has radius 1 in the solver space
UP = np.array([0.0, 1.0, 0.0])


@dataclass(eq=False)
class CameraView:
    """Where the viewer stands.

    world_from_camera: (4, 4) f64 rigid, looking along -z. yfov [rad]. distance [m] to the point that ``orbit``, ``pan``
    and ``dolly`` refer to.
    """

    world_from_camera: F64
    yfov: float
    distance: float

    @staticmethod
    def from_camera(camera: Camera, distance: float = 1.0) -> CameraView:
        """A scene's camera; ``distance`` [m] to what it looks at, best the distance to the scene's centre."""
        return CameraView(np.array(camera.world_from_camera, np.float64), float(camera.yfov), max(distance, 1e-9))

    def copy(self) -> CameraView:
        return CameraView(self.world_from_camera.copy(), self.yfov, self.distance)

    @property
    def eye(self) -> F64:
        """(3,) [m]"""
        return self.world_from_camera[:3, 3]

    @property
    def forward(self) -> F64:
        """(3,) unit."""
        return -self.world_from_camera[:3, 2]

    @property
    def target(self) -> F64:
        """(3,) [m]: the point that orbiting goes around."""
        return self.eye + self.forward * self.distance

    # -- moving --------------------------------------------------------------------------------------------------------

    def orbit(self, dx: float, dy: float) -> None:
        """Go around the target: to the right by dx, up by dy [rad]. Keeps the horizon level."""
        target = self.target
        yaw, pitch = self._yaw_pitch()
        self._turn_to(yaw + dx, pitch + dy)
        self.world_from_camera[:3, 3] = target - self.forward * self.distance

    def pan(self, dx: float, dy: float) -> None:
        """Move sideways and up, in heights of the picture at the target's distance."""
        height = 2 * self.distance * np.tan(self.yfov / 2)
        self.world_from_camera[:3, 3] += self.world_from_camera[:3, :2] @ np.array([dx, dy]) * height

    def dolly(self, factor: float) -> None:
        """Make the distance to the target ``factor`` times what it is (< 1 comes closer)."""
        target = self.target
        self.distance = max(self.distance * factor, 1e-9)
        self.world_from_camera[:3, 3] = target - self.forward * self.distance

    def fly(self, right: float, up: float, forward: float) -> None:
        """Move by so many metres: along the view, and straight up."""
        self.world_from_camera[:3, 3] += self.world_from_camera[:3, 0] * right + UP * up + self.forward * forward

    def focus(self, centre: F64, radius: float) -> None:
        """Look at a sphere [m] from where the view points now, so that it fits the height of the picture."""
        self.distance = max(float(radius), 1e-9) / float(np.sin(self.yfov / 2))
        self.world_from_camera[:3, 3] = np.asarray(centre) - self.forward * self.distance

    # -- matrices ------------------------------------------------------------------------------------------------------

    def clip_from_local(self, aspect: float, space: SolverSpace) -> F64:
        """(4, 4) f64, column vectors: solver space (radius 1) to clip space; aspect = width / height."""
        eye = space.local_from_world(self.eye)
        away = float(np.linalg.norm(eye))
        near = max(NEAREST * min(1.0, self.distance / space.scale), away - FAR_MARGIN)
        far = max(away + FAR_MARGIN, 2 * near)
        camera_from_local = np.eye(4)
        camera_from_local[:3, :3] = self.world_from_camera[:3, :3].T
        camera_from_local[:3, 3] = -self.world_from_camera[:3, :3].T @ eye
        y = 1.0 / np.tan(self.yfov / 2)
        depth = [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)]
        return np.array([[y / aspect, 0, 0, 0], [0, y, 0, 0], depth, [0, 0, -1, 0]]) @ camera_from_local

    # -- angles --------------------------------------------------------------------------------------------------------

    def _yaw_pitch(self) -> tuple[float, float]:
        right, back = self.world_from_camera[:3, 0], self.world_from_camera[:3, 2]
        pitch = float(np.arcsin(np.clip(back[1], -1, 1)))
        # straight up or down only the right axis still knows the heading
        heading = np.array([back[0], back[2]]) if abs(pitch) < POLE else np.array([-right[2], right[0]])
        return float(np.arctan2(heading[0], heading[1])), pitch

    def _turn_to(self, yaw: float, pitch: float) -> None:
        self.world_from_camera[:3, :3] = _rotation(yaw, float(np.clip(pitch, -POLE, POLE)))


def _rotation(yaw: float, pitch: float) -> NDArray[np.float64]:
    """(3, 3): columns right, up, back of an eye that stands at this yaw and pitch [rad] and looks at the origin."""
    back = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    right = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
    return np.stack([right, np.cross(back, right), back], axis=1)
