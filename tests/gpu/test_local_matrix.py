"""The local matrix on the GPU against plain arrays in 64 bits: nodes that come and go by thousands, and the paper's equations."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.errors import UserError
from app.gpu import Gpu
from app.scene.model import F64
from app.solvers.local.matrix import ROW, LocalMatrix

NODES = 68  # of a closed room: nearly all of them are in the set, so that light is reflected often
ALBEDO = 0.9
SWAPS = 3000  # of each node some fifty
SINGLE = 1e-3  # of the largest entry: asked for; 4e-7 was measured
# a half float has 11 bits: 2^-12 of each number, whenever it is added to; every node that enters writes its row anew
HALF = 1e-2


class Room:
    """Form factors among nodes in which light goes round: symmetric A F, rows that sum to 1."""

    def __init__(self, nodes: int = NODES, seed: int = 1, albedo: float = ALBEDO) -> None:
        random = np.random.default_rng(seed)
        self.area = random.uniform(0.5, 2.0, nodes)
        seen = np.triu(random.random((nodes, nodes)) * (random.random((nodes, nodes)) < 0.3), 1)
        both, scale = seen + seen.T, np.ones(nodes)
        for _ in range(500):
            scale *= np.sqrt(self.area / (scale * (both @ scale)))
        self.F = scale[:, None] * both * scale / self.area[:, None]
        self.kernel = self.F * np.sqrt(self.area[:, None] / self.area)
        self.albedo = albedo

    def reflections(self, nodes: NDArray[np.int64]) -> F64:
        """S (n, n) of all reflections among these nodes, by a fresh inverse."""
        F, root = self.F[np.ix_(nodes, nodes)], np.sqrt(self.area[nodes])
        return np.asarray(root[:, None] * (F @ np.linalg.inv(np.eye(len(nodes)) - self.albedo * F)) / root)


class Held:
    """A matrix, with what is in its slots."""

    def __init__(self, gpu: Gpu, room: Room, bounces: str, bits: int = 32) -> None:
        self.room, self.matrix = room, LocalMatrix(gpu, ROW, bounces, bits)
        self.node = np.full(ROW, -1)

    def enter(self, slot: int, node: int, seen: NDArray[np.bool_] | None = None) -> None:
        self.node[slot] = node
        there = self.node >= 0
        kernel = np.where(there, self.room.kernel[node, self.node], 0.0)
        others = np.repeat((self.room.albedo * there)[:, None], 3, 1)
        albedo = np.full(3, self.room.albedo)
        self.matrix.enter(slot, kernel, albedo, others, np.zeros(ROW, bool) if seen is None else seen)

    def leave(self, slot: int) -> None:
        self.matrix.leave(slot, np.full(3, self.room.albedo))
        self.node[slot] = -1

    def fill(self, nodes: int) -> None:
        for slot in range(nodes):
            self.enter(slot, slot)

    @property
    def S(self) -> F64:
        return self.matrix.read()[..., 0].astype(np.float64)


def off(mine: F64, other: F64) -> float:
    """The largest difference, of the largest entry."""
    return float(np.abs(mine - other).max() / np.abs(other).max())


@pytest.mark.parametrize(("bits", "tolerance"), [(32, SINGLE), (16, HALF)])
def test_thousands_of_swaps_leave_the_inverse_as_a_fresh_one(gpu: Gpu, bits: int, tolerance: float) -> None:
    room, random = Room(), np.random.default_rng(2)
    held = Held(gpu, room, "inverse", bits)
    held.fill(ROW)
    for _ in range(SWAPS):
        slot = int(random.integers(ROW))
        node = int(random.choice(np.setdiff1d(np.arange(NODES), held.node)))
        held.leave(slot)
        held.enter(slot, node)
    assert off(held.S, room.reflections(held.node)) < tolerance
    held.matrix.release()


@pytest.mark.parametrize("bounces", ["inverse", "iterate"])
def test_nodes_that_left_leave_no_trace(gpu: Gpu, bounces: str) -> None:
    """Whether they leave one by one or all at once, beyond what may wait for a pass over the matrix."""
    room = Room()
    held = Held(gpu, room, bounces)
    held.fill(ROW)
    for slot in range(10, ROW):
        held.leave(slot)
    nodes = np.arange(10)
    expected = room.reflections(nodes) if bounces == "inverse" else room.kernel[:10, :10]
    np.testing.assert_allclose(held.S[:10, :10], expected, atol=1e-6)
    assert not held.S[10:].any() and not held.S[:, 10:].any()
    held.matrix.release()


@pytest.mark.parametrize("bounces", ["inverse", "iterate"])
def test_slivers_stay_within_half_floats(gpu: Gpu, bounces: str) -> None:
    """Patches a million times as small as others that see each other: what is stored is never more than what is reflected."""
    room = Room()
    held = Held(gpu, room, bounces, bits=16)
    small = np.where(np.arange(NODES) % 2, 1e-6, 1.0)
    room.area = room.area * small
    room.F = (
        0.5 * np.minimum(1.0, room.area / room.area[:, None]) * (room.F > 0) / NODES
    )  # symmetric A F, slivers see little
    room.kernel = room.F * np.sqrt(room.area[:, None] / room.area)
    held.fill(ROW)
    nodes = np.arange(ROW)
    expected = room.reflections(nodes) if bounces == "inverse" else room.kernel[:ROW, :ROW]
    assert np.isfinite(held.S).all() and off(held.S, expected) < HALF
    held.matrix.release()


def of_the_paper(room: Room, order: list[int]) -> F64:
    """S (ROW, ROW) by equations 1 to 5 of [Shcherbakov19] as its authors have them, of nodes that enter in that order, each into
    the slot of its number."""
    S, there = np.zeros((ROW, ROW)), []
    for n in order:
        f = np.zeros(ROW)
        f[there] = room.kernel[n, there]
        double = room.albedo**2 * (f * f).sum()  # 1
        g = f * (1 + double)  # 2, with f itself
        column = g + S @ (room.albedo * g)  # 3, 4
        S += room.albedo * np.outer(column, column)  # 5
        S[n, :], S[:, n] = column, column
        there.append(n)
    return S


def test_the_series_is_that_of_the_paper(gpu: Gpu) -> None:
    room = Room()
    held = Held(gpu, room, "series")
    held.fill(ROW)
    expected = of_the_paper(room, list(range(ROW)))
    np.testing.assert_allclose(held.S, expected, rtol=1e-4, atol=1e-4 * expected.max())
    held.matrix.release()


def test_the_series_is_the_inverse_but_for_what_is_cut_short(gpu: Gpu) -> None:
    """It has (1 + d)² for 1/(1 - ρσ), which begins as 1 + d, and no closed path of a node itself: second order in the albedo,
    where what is reflected is first."""
    gained = []
    for albedo in (0.05, 0.1, 0.9):
        room = Room(albedo=albedo)
        held = Held(gpu, room, "series")
        held.fill(ROW)
        exact = room.reflections(np.arange(ROW))
        apart = ~np.eye(ROW, dtype=bool)
        first = room.kernel[:ROW, :ROW]
        gained.append(np.abs(held.S - exact)[apart].sum() / (exact - first)[apart].sum())
        held.matrix.release()
    assert gained[0] < 0.1 and gained[1] == pytest.approx(2 * gained[0], rel=0.5)
    assert 2 * gained[1] < gained[2] < 0.2


def test_nodes_that_left_leave_a_trace_in_the_series(gpu: Gpu) -> None:
    """Paths through them stay, and are left out when they come again; where that is not known they are counted twice."""
    room = Room(albedo=0.3)
    held = Held(gpu, room, "series")
    held.fill(ROW)
    before = held.S
    held.leave(5)
    others = np.delete(np.arange(ROW), 5)
    without = of_the_paper(room, others.tolist())
    assert off(held.S[np.ix_(others, others)], without[np.ix_(others, others)]) > 1e-3
    np.testing.assert_allclose(held.S[np.ix_(others, others)], before[np.ix_(others, others)], atol=1e-5)
    held.enter(5, 5, np.ones(ROW, bool))
    np.testing.assert_allclose(held.S[np.ix_(others, others)], before[np.ix_(others, others)], atol=1e-5)
    held.leave(5)
    held.enter(5, 5)
    assert off(held.S[np.ix_(others, others)], before[np.ix_(others, others)]) > 1e-3
    held.matrix.release()


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize("bounces", ["inverse", "iterate"])
def test_a_product_is_that_of_the_matrix(gpu: Gpu, bounces: str, bits: int) -> None:
    """Also with updates that wait."""
    room, random = Room(), np.random.default_rng(3)
    held = Held(gpu, room, bounces, bits)
    held.fill(ROW)
    vector = random.random((ROW, 4)).astype(np.float32)
    texture = gpu.texture((ROW, 1), 4, "f4", vector.tobytes())
    parts = np.frombuffer(held.matrix.multiply(texture).read(), np.float32).reshape(ROW, -1, 4).sum(1)
    expected = held.S @ vector[:, :3]
    np.testing.assert_allclose(parts[:, :3], expected, rtol=1e-4, atol=1e-4 * float(expected.max()))
    gpu.release_all(texture)
    held.matrix.release()


def test_a_matrix_beyond_the_drivers_textures_is_refused(gpu: Gpu) -> None:
    most = gpu.limits.max_texture + 1
    with pytest.raises(UserError, match=f"--patches {most}: textures of this driver"):
        LocalMatrix(gpu, most, "inverse", 16)
