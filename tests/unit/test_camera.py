"""The eye: its moves keep what they promise, and its two ways from picture to world agree."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from pictures import framing, ray

from app.lightmap.tile_pool import SolverSpace
from app.render.camera import CameraView

FRAME = SolverSpace(np.array([3.0, -1.0, 2.0]), 2.5)


def a_view() -> CameraView:
    view = framing(FRAME.centre - 1.4, FRAME.centre + 1.4)
    view.pan(0.1, -0.05)
    return view


MOVES: dict[str, Callable[[CameraView], None]] = {
    "orbit": lambda v: v.orbit(0.4, -0.3),
    "pan": lambda v: v.pan(0.2, 0.1),
    "dolly": lambda v: v.dolly(0.7),
    "fly": lambda v: v.fly(0.3, 0.2, 1.0),
    "focus": lambda v: v.focus(np.array([1.0, 2.0, 3.0]), 0.5),
}
KEEPS = {"orbit": ("target", "distance"), "dolly": ("target", "forward")}
KEEPS |= {"pan": ("forward", "distance"), "fly": ("forward", "distance"), "focus": ("forward",)}


@pytest.mark.parametrize("move", MOVES)
def test_a_move_changes_the_view_and_keeps_its_promise(move: str) -> None:
    view = a_view()
    before = view.copy()
    MOVES[move](view)
    assert not np.allclose(view.world_from_camera, before.world_from_camera)
    for kept in KEEPS[move]:
        assert getattr(view, kept) == pytest.approx(getattr(before, kept))
    rotation = view.world_from_camera[:3, :3]
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert rotation[1, 0] == pytest.approx(0, abs=1e-12), "the horizon is level"


def test_directions_of_the_moves() -> None:
    """Right is right, up is up."""
    for move, axis in ((lambda v: v.orbit(0.1, 0), 0), (lambda v: v.orbit(0, 0.1), 1), (lambda v: v.pan(0.1, 0), 0)):
        view = a_view()
        before = view.copy()
        move(view)
        assert (view.eye - before.eye) @ before.world_from_camera[:3, axis] > 0


def test_orbit_stops_short_of_the_poles_and_comes_back() -> None:
    view = a_view()
    for _ in range(10):
        view.orbit(0.0, 1.0)
    assert view.forward[1] < -0.999
    view.orbit(0.3, -0.5)
    assert np.isfinite(view.world_from_camera).all()
    assert view.forward[1] > -0.999


def test_a_camera_that_looks_straight_down_keeps_its_heading() -> None:
    down = np.eye(4)
    down[:3, :3] = np.stack([[0.0, 0, 1], [1.0, 0, 0], [0.0, 1, 0]], axis=1)  # right +z, up +x, back +y
    view = CameraView(down, 0.8, 1.0)
    view.orbit(0.0, 0.0)
    assert view.world_from_camera[:3, 0] == pytest.approx([0, 0, 1], abs=1e-9)
    # stopped half a degree short of the pole
    assert view.forward == pytest.approx([0, -1, 0], abs=0.01)


def test_focus_fits_the_sphere_to_the_height() -> None:
    view = a_view()
    centre, radius = np.array([1.0, 2.0, 3.0]), 0.5
    view.focus(centre, radius)
    assert view.target == pytest.approx(centre)
    assert np.sin(view.yfov / 2) * np.linalg.norm(view.eye - centre) == pytest.approx(radius)


@pytest.mark.parametrize("ndc", [(0.0, 0.0), (-0.8, 0.6), (1.0, -1.0)])
def test_rays_and_clip_space_agree(ndc: tuple[float, float]) -> None:
    view, aspect = a_view(), 1.6
    origin, direction = ray(view, *ndc, aspect)
    assert np.linalg.norm(direction) == pytest.approx(1)
    for distance in (0.5, 3.0):
        local = FRAME.local_from_world(origin + direction * distance)
        clip = view.clip_from_local(aspect, FRAME) @ np.append(local, 1.0)
        assert clip[:2] / clip[3] == pytest.approx(ndc, abs=1e-9)


@pytest.mark.parametrize("away", [0.0, 0.9, 1.5, 6.0])
def test_depth_tells_a_lamp_from_its_ceiling(away: float) -> None:
    """The published Cornell box hangs its lamp 0.1 mm below a ceiling, 2.1e-4 of the scene's radius. Seen from anywhere
    the two must differ by more than one of the 2^24 steps of the depth buffer, with one lost to rounding."""
    gap = 0.1 / 476.0
    view = CameraView(np.eye(4), 0.7, 1.0)
    view.world_from_camera[:3, 3] = FRAME.centre + np.array([0, 0, away]) * FRAME.scale
    clip = view.clip_from_local(1.0, FRAME)
    ceiling = clip @ np.array([0.0, 0.5, -0.8, 1.0])
    # straight ahead is the worst case: the gap lies along the view there
    lamp = clip @ np.array([0.0, 0.5, -0.8 + gap, 1.0])
    steps = (ceiling[2] / ceiling[3] - lamp[2] / lamp[3]) / 2 * 2**24
    assert steps > 2


@pytest.mark.parametrize("away", [0.0, 1.5, 50.0])
def test_the_whole_scene_lies_before_the_far_plane(away: float) -> None:
    view = CameraView(np.eye(4), 0.7, 1.0)
    view.world_from_camera[:3, 3] = FRAME.centre + np.array([0, 0, away]) * FRAME.scale
    clip = view.clip_from_local(1.0, FRAME)
    back = clip @ np.array([0.0, 0.0, -1.0, 1.0])
    assert back[2] / back[3] < 1 - 2e-6, "in front of the background too"
    if away > 1:
        front = clip @ np.array([0.0, 0.0, 1.0, 1.0])
        assert front[2] / front[3] > -1
